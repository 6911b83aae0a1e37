//! `stride split`, by the shell and by the schedulers of `examples/farm/`.
use crate::common::watched::poll;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::net::TcpListener;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

const SHARDS: usize = 3;

/// Options of a small render.
const SMALL: [&str; 8] = ["--size", "9x7", "--spp", "13", "--seed", "3", "--layers", "all"];

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn example(name: &str) -> String {
    format!("{}/examples/farm/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn run(command: &mut Command, folder: &Path) -> Output {
    command.current_dir(folder).stdin(Stdio::null()).output().expect("the program starts")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn succeed(command: &mut Command, folder: &Path) -> Vec<u8> {
    let output = run(command, folder);
    assert!(output.status.success(), "{command:?}: {}", said(&output));
    output.stdout
}

fn stride<S: AsRef<OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.args(arguments);
    command
}

/// Writes the commands that split a small render of the cover to a file, and what they should make.
fn prepare(folder: &Path) -> Vec<u8> {
    fs::copy(format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR")), folder.join("scene.toml"))
        .expect("a scene");
    let into = SHARDS.to_string();
    let split = [&["split", "scene.toml", "--into", &into, "-o", "merged.film"][..], &SMALL].concat();
    let commands = succeed(&mut stride(&split), folder);
    assert_eq!(commands.iter().filter(|&&c| c == b'\n').count(), SHARDS + 1);
    fs::write(folder.join("commands.sh"), commands).expect("a file");
    let film = ["render", "scene.toml", "--film", "whole.film", "-o", "whole.exr", "--headless", "-q"];
    succeed(&mut stride(&[&film[..], &SMALL].concat()), folder);
    bytes(folder, "whole.film")
}

#[test]
fn a_shell_runs_the_commands_to_the_film_of_one_render() {
    let dir = folder();
    let expected = prepare(dir.path());
    // Everything that a shell might take for something else, a byte that is not UTF-8 among it.
    let scene = OsStr::from_bytes(b"-a \xe9 scene's $HOME & ~.toml");
    fs::copy(dir.path().join("scene.toml"), dir.path().join(scene)).expect("a scene");
    let mut words: Vec<OsString> =
        ["split", "--into", "5", "-o", "m.film", "-o", "m.exr", "--exposure", "-1"].map(Into::into).into();
    words.extend(SMALL.map(Into::into));
    words.extend(["--".into(), scene.to_owned()]);
    let commands = succeed(&mut stride(&words), dir.path());
    fs::write(dir.path().join("m.sh"), &commands).expect("a file");
    let shell =
        || Command::new("sh").args(["-eu", "m.sh"]).current_dir(dir.path()).output().expect("a shell");
    let output = shell();
    assert!(output.status.success(), "{}", said(&output));
    let film = |number: u32| {
        let name = [&b"-a \xe9 scene's $HOME & ~-"[..], number.to_string().as_bytes(), b".film"].concat();
        dir.path().join(OsStr::from_bytes(&name))
    };
    assert!((1..=5).all(|number| film(number).exists()) && !film(6).exists());
    // Films note the exposure, which is no part of the samples.
    let whole = ["render", "scene.toml", "--film", "whole.film", "-o", "whole.exr", "--headless", "-q"];
    succeed(&mut stride(&[&whole[..], &["--exposure", "-1"], &SMALL].concat()), dir.path());
    assert!(bytes(dir.path(), "m.film") == bytes(dir.path(), "whole.film"));
    assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "whole.exr"));
    assert!(bytes(dir.path(), "m.film") != expected, "negative control: it notes another exposure");
    // Pictures of shards are not written.
    let names = fs::read_dir(dir.path()).expect("a folder").map(|entry| entry.expect("an entry").path());
    assert_eq!(names.filter(|path| path.extension().is_some_and(|e| e == "png")).count(), 0);

    // A film that is missing fails the merge, and the same commands make it: the other films are continued.
    fs::remove_file(film(2)).expect("a film");
    let merge = commands.split(|&c| c == b'\n').nth(5).expect("the last line");
    let output = run(Command::new("sh").arg("-c").arg(OsStr::from_bytes(merge)), dir.path());
    assert!(!output.status.success() && said(&output).contains("-2.film"), "{}", said(&output));
    let output = shell();
    assert!(output.status.success() && !said(&output).contains("will be replaced"), "{}", said(&output));
    assert!(bytes(dir.path(), "m.film") == bytes(dir.path(), "whole.film"));
    // So does one that lacks samples, as after an interruption.
    fs::remove_file(film(5)).expect("a film");
    let part: Vec<OsString> = ["render", "--range", "10..12", "-q", "--film"].map(Into::into).into();
    let small = SMALL.map(OsString::from).into_iter().filter(|word| word != "--spp" && word != "13");
    let rest = [film(5).into_os_string(), "scene.toml".into()];
    succeed(&mut stride(&part.into_iter().chain(rest).chain(small).collect::<Vec<_>>()), dir.path());
    let output = run(Command::new("sh").arg("-c").arg(OsStr::from_bytes(merge)), dir.path());
    assert!(!output.status.success() && said(&output).contains("0..12, and --spp 13"), "{}", said(&output));
    let output = shell();
    assert!(output.status.success(), "{}", said(&output));
    assert!(bytes(dir.path(), "m.film") == bytes(dir.path(), "whole.film"));
    // A film of another render is not replaced.
    let other = ["render", "scene.toml", "--size", "8x7", "--range", "0..1", "--film", "scene-1.film", "-q"];
    succeed(&mut stride(&other), dir.path());
    let output = run(Command::new("sh").args(["-e", "commands.sh"]), dir.path());
    assert!(!output.status.success() && said(&output).contains("its size is"), "{}", said(&output));
}

#[test]
fn what_cannot_be_split_is_refused() {
    let dir = folder();
    prepare(dir.path());
    let scene = fs::read_to_string(dir.path().join("scene.toml")).expect("a scene");
    let adaptive = scene.replacen("[render]", "[render]\nadaptive = true", 1);
    assert!(adaptive != scene);
    fs::write(dir.path().join("adaptive.toml"), adaptive).expect("a scene");
    fs::copy(dir.path().join("scene.toml"), dir.path().join("a\nb.toml")).expect("a scene");
    let split =
        |scene: &str, more: &[&str]| run(&mut stride(&[&["split", scene][..], more].concat()), dir.path());
    for (scene, more, code, word) in [
        ("scene.toml", &[][..], 2, "--into"),
        ("scene.toml", &["--into", "0"], 2, "1..=10000"),
        ("scene.toml", &["--into", "10001"], 2, "1..=10000"),
        ("scene.toml", &["--into", "-3"], 2, "--into"),
        ("scene.toml", &["--into", "2", "--noise", "0.1"], 2, "--noise: a render ends at an error"),
        ("scene.toml", &["--into", "2", "--adaptive"], 2, "--adaptive: samples are distributed by an error"),
        ("adaptive.toml", &["--into", "2"], 2, "adaptive = true"),
        ("scene.toml", &["--into", "2", "--range", "3..9"], 2, "--range: the samples"),
        ("scene.toml", &["--into", "2", "--time", "3s"], 2, "--time"),
        ("scene.toml", &["--into", "2", "--resume", "whole.film"], 2, "render --range"),
        ("scene.toml", &["--into", "2", "--dump-at", "8"], 2, "--dump-at"),
        ("scene.toml", &["--into", "2", "--layers", "colour"], 2, "layer"),
        ("scene.toml", &["--into", "2", "--crop", "0,0,9999,9"], 2, "--crop"),
        ("scene.toml", &["--into", "2", "-o", "a.jpg"], 2, ".jpg"),
        ("scene.toml", &["--into", "2", "-o", "scene-2.film"], 2, "another name"),
        ("scene.toml", &["--into", "2", "--film", "none/a.film"], 1, "none/a-1.film"),
        ("a\nb.toml", &["--into", "2"], 2, "line break"),
        ("none.toml", &["--into", "2"], 1, "none.toml"),
    ] {
        let output = split(scene, more);
        assert_eq!(output.status.code(), Some(code), "{more:?}: {}", said(&output));
        assert!(said(&output).contains(word) && output.stdout.is_empty(), "{more:?}: {}", said(&output));
    }
    // There are no shards without samples.
    let output = split("scene.toml", &["--into", "64", "--spp", "3"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 4);
    let note = "note: 3 samples per pixel make 3 shards of one sample, not 64\n";
    assert!(output.status.success() && said(&output) == note, "{}", said(&output));
    assert_eq!(said(&split("scene.toml", &["--into", "64", "--spp", "64"])), "");
}

#[test]
fn kubernetes_containers_run_the_commands() {
    let dir = folder();
    let expected = prepare(dir.path());
    let manifest = fs::read_to_string(example("kubernetes.yaml")).expect("a manifest");
    let scripts =
        manifest.lines().filter_map(|line| line.trim().strip_prefix("args: ['")?.strip_suffix("']"));
    let [render, merge] = scripts.collect::<Vec<_>>()[..] else { panic!("two jobs in {manifest}") };
    assert_eq!(manifest.matches("command: [sh, -euc]").count(), 2);
    for index in 0..SHARDS {
        let index = index.to_string();
        succeed(Command::new("sh").args(["-euc", render]).env("JOB_COMPLETION_INDEX", index), dir.path());
    }
    succeed(Command::new("sh").args(["-euc", merge]), dir.path());
    assert!(bytes(dir.path(), "merged.film") == expected);
}

/// The folders of programs, also those of administrators on Debian.
fn path() -> Vec<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).chain([PathBuf::from("/usr/sbin")]).collect()
}

/// Whether a program is installed.
fn has(name: &str) -> bool {
    let has = path().iter().any(|folder| folder.join(name).is_file());
    if !has {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"), "no {name}");
        println!("skipped: no {name}");
    }
    has
}

#[test]
fn parallel_runs_the_commands() {
    if !has("parallel") {
        return;
    }
    let dir = folder();
    let expected = prepare(dir.path());
    let mut parallel = Command::new("sh");
    parallel.args([&example("parallel.sh"), "commands.sh", "--jobs", "2"]).env("PARALLEL_HOME", dir.path());
    succeed(&mut parallel, dir.path());
    assert!(bytes(dir.path(), "merged.film") == expected);
    // A command that fails ends it before the merge.
    fs::remove_file(dir.path().join("merged.film")).expect("a film");
    fs::write(dir.path().join("scene-2.film"), "not a film").expect("a file");
    assert!(!run(&mut parallel, dir.path()).status.success());
    assert!(!dir.path().join("merged.film").exists());
}

/// Slurm on this machine without systemd: its daemons, which are killed when this is dropped.
struct Slurm<'a> {
    folder: &'a Path,
    daemons: Vec<Child>,
}

impl Slurm<'_> {
    fn start(folder: &Path) -> Slurm<'_> {
        let ports = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").expect("a port"));
        let [control, node] = ports.each_ref().map(|port| port.local_addr().expect("an address").port());
        drop(ports);
        let user = succeed(Command::new("id").arg("-un"), folder);
        let (user, at) = (String::from_utf8_lossy(&user), folder.display());
        let user = user.trim();
        // More processors than there are, so that no task waits for another; and no waiting for more jobs.
        let configuration = format!(
            "ClusterName=test
SlurmctldHost=localhost
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={at}/munge
SlurmctldPort={control}
SlurmdPort={node}
StateSaveLocation={at}
SlurmdSpoolDir={at}
SlurmctldPidFile={at}/slurmctld.pid
SlurmdPidFile={at}/slurmd.pid
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=0,sched_interval=1
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
NodeName=node NodeHostname=localhost NodeAddr=127.0.0.1 CPUs=8
PartitionName=all Nodes=node Default=YES
"
        );
        fs::write(folder.join("slurm.conf"), configuration).expect("a file");
        let key = fs::File::open("/dev/urandom").and_then(|random| {
            use std::io::{Read, copy};
            let mut options = fs::OpenOptions::new();
            let mut key = options.write(true).create_new(true).mode(0o400).open(folder.join("key"))?;
            copy(&mut random.take(64), &mut key)
        });
        key.expect("a key");
        let mut slurm = Slurm { folder, daemons: Vec::new() };
        let option = |name: &str, file: &str| format!("--{name}={at}/{file}");
        slurm.daemon(
            "munged",
            &[
                "--foreground".to_owned(),
                "--force".to_owned(),
                option("key-file", "key"),
                option("socket", "munge"),
                option("pid-file", "munged.pid"),
                option("log-file", "munged.log"),
                option("seed-file", "seed"),
            ],
        );
        slurm.daemon("slurmctld", &["-D".to_owned()]);
        slurm.daemon("slurmd", &["-D".to_owned(), "-N".to_owned(), "node".to_owned()]);
        poll("a node that is ready", || {
            let nodes = slurm.command("sinfo").args(["-h", "-o", "%T"]).output().expect("sinfo starts");
            nodes.stdout.starts_with(b"idle")
        });
        slurm
    }

    fn command(&self, name: &str) -> Command {
        let mut command = Command::new(name);
        command.env("PATH", std::env::join_paths(path()).expect("folders without colons"));
        command.env("SLURM_CONF", self.folder.join("slurm.conf")).current_dir(self.folder);
        command
    }

    fn daemon(&mut self, name: &str, arguments: &[String]) {
        let log = fs::File::create(self.folder.join(format!("{name}.out"))).expect("a file");
        let mut command = self.command(name);
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
        self.daemons.push(command.spawn().expect("a daemon"));
    }
}

impl Drop for Slurm<'_> {
    fn drop(&mut self) {
        for daemon in self.daemons.iter_mut().rev() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

#[test]
fn slurm_runs_the_commands_as_an_array() {
    if !["munged", "slurmctld", "slurmd", "sbatch"].into_iter().all(has) {
        return;
    }
    let (dir, daemons) = (folder(), folder());
    let expected = prepare(dir.path());
    let slurm = Slurm::start(daemons.path());
    let submit = |options: &[&str]| {
        let mut sbatch = slurm.command("sbatch");
        sbatch.args(["--parsable", "--output=%j.log"]).args(options);
        let job = succeed(sbatch.args([&example("slurm.sh"), "commands.sh"]), dir.path());
        String::from_utf8(job).expect("a number").trim().to_owned()
    };
    let array = submit(&[&format!("--array=1-{SHARDS}")]);
    let merge = submit(&[&format!("--dependency=afterok:{array}")]);
    let log = dir.path().join(format!("{merge}.log"));
    // The last line of a merge names the file that it wrote.
    poll("the end of the merge", || {
        fs::read_to_string(&log).is_ok_and(|log| log.contains("wrote merged.film"))
    });
    assert!(bytes(dir.path(), "merged.film") == expected);
}
