//! A server, workers and collectors on this machine.

use crate::common::watched::{Watched, poll};
use std::cell::Cell;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::Once;
use std::sync::atomic::{AtomicU16, Ordering};
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
    // Past the capture of the output of tests that pass; once, as all of them say so.
    static SAID: Once = Once::new();
    SAID.call_once(|| {
        let why = "there is no nats-server on the path (Debian's package nats-server)";
        let _ = writeln!(std::io::stderr(), "skipped: the tests of the fleet with a server: {why}");
    });
    false
}

/// Whether this build has faults on request.
pub(crate) fn has_faults() -> bool {
    if cfg!(any(debug_assertions, feature = "broken-material")) {
        return true;
    }
    println!("skipped: this build has no faults on request");
    false
}

pub(crate) fn cover() -> String {
    scene("cover")
}

pub(crate) fn scene(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// Sends a signal to a process.
pub(crate) fn signal(name: &str, child: &Child) {
    let status = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
}

/// A command whose process ends with the test, even if the test is killed.
pub(crate) fn bound(program: &str) -> Command {
    let has_setpriv = Command::new("setpriv").arg("--version").stdout(Stdio::null()).status();
    if !has_setpriv.is_ok_and(|status| status.success()) {
        return Command::new(program);
    }
    let mut command = Command::new("setpriv");
    command.args(["--pdeathsig", "KILL", program]);
    command
}

/// A port that is free, outside of the range from which the system gives ports to clients: a client that looks for a server
/// that is down must not get its port.
pub(crate) fn free_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    loop {
        let next = u32::from(NEXT.fetch_add(1, Ordering::Relaxed));
        let port = 10_000 + ((std::process::id().wrapping_mul(97) + next) % 20_000) as u16;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return port;
        }
    }
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

    /// Whether it has ended.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.0.try_wait().expect("a child").is_some()
    }

    /// Waits for its end, for a limited time.
    pub(crate) fn end(&mut self) -> ExitStatus {
        poll("the end of a process", || self.has_ended());
        self.0.wait().expect("it has ended")
    }
}

/// A folder with a server and the files of all others.
pub(crate) struct Place {
    pub(crate) folder: TempDir,
    pub(crate) port: u16,
    /// Arguments of the server for its store.
    pub(crate) options: &'static [&'static str],
    /// Further arguments of the server.
    pub(crate) more: Vec<String>,
    server: Option<Process>,
    /// The number of commands that were run.
    commands: Cell<u32>,
}

impl Place {
    /// A place without a server.
    pub(crate) fn without_server() -> Place {
        let folder = tempfile::tempdir().unwrap();
        let (options, more) = (&["-js", "-sd", "store"], Vec::new());
        Place { folder, port: free_port(), options, more, server: None, commands: Cell::new(0) }
    }

    /// A place with a server that has started.
    pub(crate) fn start(more: &[&str]) -> Place {
        let more = more.iter().map(|&argument| argument.to_owned()).collect();
        let mut place = Place { more, ..Place::without_server() };
        place.start_server();
        place
    }

    /// Starts the server; again if its port is not free yet.
    pub(crate) fn start_server(&mut self) {
        self.launch_server();
        poll("the server's port", || {
            if self.server().has_ended() {
                self.launch_server();
            }
            TcpStream::connect(("127.0.0.1", self.port)).is_ok()
        });
    }

    fn launch_server(&mut self) {
        self.server = None;
        let log = File::create(self.path("server.log")).unwrap();
        let child = bound("nats-server")
            .args(["-a", "127.0.0.1", "-p", &self.port.to_string()])
            .args(self.options)
            .args(&self.more)
            .current_dir(self.folder.path())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .expect("nats-server starts");
        self.server = Some(Process(child));
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
        self.stride_at(&self.url(), arguments)
    }

    /// The same with another server.
    pub(crate) fn stride_at(&self, url: &str, arguments: &[&str]) -> Command {
        let mut command = bound(env!("CARGO_BIN_EXE_stride"));
        command.args(arguments).current_dir(self.folder.path()).env("XDG_CACHE_HOME", self.path("cache"));
        // Unoptimised lanes need much stack.
        command.env("RUST_MIN_STACK", (64 << 20).to_string());
        if !["render", "fleet"].contains(&arguments[0]) {
            command.args(["--broker", url]);
        }
        command
    }

    /// Runs a command, for a limited time.
    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        self.run_command(self.stride(arguments))
    }

    pub(crate) fn run_command(&self, mut command: Command) -> Output {
        let number = self.commands.replace(self.commands.get() + 1);
        let [out, err] = ["out", "err"].map(|kind| self.path(&format!("command-{number}.{kind}")));
        command.stdin(Stdio::null()).stdout(File::create(&out).unwrap()).stderr(File::create(&err).unwrap());
        let status = Process(command.spawn().expect("stride starts")).end();
        Output { status, stdout: fs::read(out).unwrap(), stderr: fs::read(err).unwrap() }
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
        self.watch_command(self.stride(arguments))
    }

    pub(crate) fn watch_command(&self, mut command: Command) -> Watched {
        command.stdout(Stdio::null());
        Watched::start(command, self.folder.path())
    }

    /// Publishes a message that stride would not, in the protocol of the server.
    pub(crate) fn publish(&self, subject: &str, payload: &str) {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the server");
        let text = format!(
            "CONNECT {{\"verbose\":false}}\r\nPUB {subject} {}\r\n{payload}\r\nPING\r\n",
            payload.len()
        );
        (&stream).write_all(text.as_bytes()).expect("it can be written to");
        let mut lines = BufReader::new(&stream).lines().map_while(Result::ok);
        assert!(lines.any(|line| line == "PONG"), "the server does not answer");
    }

    /// Compares film and picture with those of one machine.
    pub(crate) fn expect_single(&self, name: &str, more: &[&str]) {
        self.expect_single_of(&cover(), name, more);
    }

    /// The same for another scene.
    pub(crate) fn expect_single_of(&self, scene: &str, name: &str, more: &[&str]) {
        let (film, exr) = (format!("{name}-one.film"), format!("{name}-one.exr"));
        let fixed = ["render", scene, "--headless", "-q", "--size", SIZE, "--film", &film, "-o", &exr];
        self.succeed(&[&fixed[..], more].concat());
        let same = |a: &Path, b: &Path| fs::read(a).unwrap() == fs::read(b).unwrap();
        assert!(same(&self.path(&format!("{name}.exr")), &self.path(&exr)), "{name}: another picture");
        assert!(same(&self.path(&format!("{name}.film")), &self.path(&film)), "{name}: another film");
    }
}
