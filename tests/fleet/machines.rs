//! A server, workers and collectors on this machine.

use crate::common::watched::{Watched, poll};
use std::fs::{self, File};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

/// The size of all pictures here.
pub(crate) const SIZE: &str = "16x12";

/// Whether there is a server to test with.
pub(crate) fn has_server() -> bool {
    let found = Command::new("nats-server").arg("--version").stdout(Stdio::null()).status();
    if found.is_ok_and(|status| status.success()) {
        return true;
    }
    assert!(std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1"), "there is no nats-server");
    println!("skipped: there is no nats-server");
    false
}

pub(crate) fn cover() -> String {
    format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"))
}

/// Sends a signal to a process.
pub(crate) fn signal(name: &str, child: &Child) {
    let status = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
}

/// A process that is killed when dropped.
pub(crate) struct Process(pub(crate) Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Process {
    /// Kills it at once.
    pub(crate) fn kill(&mut self) {
        self.0.kill().expect("it can be killed");
        self.0.wait().expect("it ends");
    }
}

/// A folder with a server and the files of all others.
pub(crate) struct Place {
    pub(crate) folder: TempDir,
    pub(crate) port: u16,
    /// Further arguments of the server.
    pub(crate) more: Vec<String>,
    server: Option<Process>,
}

impl Place {
    /// A place with a server that has started.
    pub(crate) fn start(more: &[&str]) -> Place {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let more = more.iter().map(|&argument| argument.to_owned()).collect();
        let mut place = Place { folder: tempfile::tempdir().unwrap(), port, more, server: None };
        place.start_server();
        place
    }

    pub(crate) fn start_server(&mut self) {
        self.server = None;
        let log = File::create(self.path("server.log")).unwrap();
        let child = Command::new("nats-server")
            .args(["-a", "127.0.0.1", "-p", &self.port.to_string(), "-js", "-sd", "store"])
            .args(&self.more)
            .current_dir(self.folder.path())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .expect("nats-server starts");
        self.server = Some(Process(child));
        poll("the server's port", || TcpStream::connect(("127.0.0.1", self.port)).is_ok());
    }

    pub(crate) fn server(&mut self) -> &mut Process {
        self.server.as_mut().unwrap()
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }

    /// A command of stride with this server and a cache of the whole place.
    pub(crate) fn stride(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
        command.args(arguments).current_dir(self.folder.path()).env("XDG_CACHE_HOME", self.path("cache"));
        // Unoptimised lanes need much stack.
        command.env("RUST_MIN_STACK", (64 << 20).to_string());
        if arguments[0] != "render" {
            command.args(["--broker", &self.url()]);
        }
        command
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        self.stride(arguments).output().expect("stride starts")
    }

    /// Runs a command that must succeed; returns its standard output and standard error.
    pub(crate) fn succeed(&self, arguments: &[&str]) -> (String, String) {
        let output = self.run(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {said}");
        (String::from_utf8_lossy(&output.stdout).into_owned(), said)
    }

    /// Runs a command that must fail; returns its message.
    pub(crate) fn fail(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        said
    }

    /// A worker of one thread, whose output is in a file of its name.
    pub(crate) fn worker(&self, name: &str, set: impl FnOnce(&mut Command)) -> Process {
        let log = fs::OpenOptions::new().create(true).append(true).open(self.path(&format!("{name}.log")));
        let mut command = self.stride(&["work", "--threads", "1", "--name", name]);
        command.stdout(Stdio::null()).stderr(log.unwrap());
        set(&mut command);
        Process(command.spawn().expect("a worker starts"))
    }

    pub(crate) fn said(&self, name: &str) -> String {
        fs::read_to_string(self.path(&format!("{name}.log"))).unwrap_or_default()
    }

    /// A program whose lines are received.
    pub(crate) fn watch(&self, arguments: &[&str]) -> Watched {
        let mut command = self.stride(arguments);
        command.stdout(Stdio::null());
        Watched::start(command, self.folder.path())
    }

    /// Compares film and picture with those of one machine.
    pub(crate) fn expect_single(&self, name: &str, more: &[&str]) {
        let (scene, film, exr) = (cover(), format!("{name}-one.film"), format!("{name}-one.exr"));
        let fixed = ["render", &scene, "--headless", "-q", "--size", SIZE, "--film", &film, "-o", &exr];
        self.succeed(&[&fixed[..], more].concat());
        let same = |a: &Path, b: &Path| fs::read(a).unwrap() == fs::read(b).unwrap();
        assert!(same(&self.path(&format!("{name}.exr")), &self.path(&exr)), "{name}: another picture");
        assert!(same(&self.path(&format!("{name}.film")), &self.path(&film)), "{name}: another film");
    }
}
