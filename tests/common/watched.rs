//! Observes a running program. The lines of its standard error, the changes to the files of its folder and its end
//! arrive as messages: tests are synchronised by these and not by elapsed time.

use crossbeam_channel::{Receiver, Sender, unbounded};
use rand::RngExt;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use stride::sampling::Stream;

/// The time after which a test fails. No passing test depends on it.
const DEADLINE: Duration = Duration::from_secs(120);

/// A message about a watched program.
enum Message {
    /// A line on standard error.
    Line(String),
    /// A file of the folder was created, written to or renamed into place.
    Changed,
    /// Standard error was closed: the program has ended.
    Ended,
}

/// A watched program. It is killed when dropped: a failed test leaves none behind.
pub struct Watched {
    child: Child,
    folder: PathBuf,
    messages: Receiver<Message>,
    said: String,
}

impl Watched {
    /// Starts a program, and watches it and the files of a folder.
    pub fn start(mut command: Command, folder: &Path) -> Watched {
        let (sender, messages) = unbounded();
        // Before the program starts, so that none of its changes is missed.
        watch(folder, sender.clone());
        let mut child = command.stderr(Stdio::piped()).spawn().expect("the program starts");
        let stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        std::thread::spawn(move || {
            // A finished test reads no messages, but the program must still be able to write.
            for line in stderr.lines().map_while(Result::ok) {
                let _ = sender.send(Message::Line(line));
            }
            let _ = sender.send(Message::Ended);
        });
        Watched { child, folder: folder.to_path_buf(), messages, said: String::new() }
    }

    /// The program's process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Its output so far.
    pub fn said(&self) -> &str {
        &self.said
    }

    /// The next message, `None` at the program's end.
    fn next(&mut self, deadline: Instant, waiting_for: &dyn Fn() -> String) -> Option<Message> {
        match self.messages.recv_deadline(deadline) {
            Ok(Message::Line(line)) => {
                self.said += &line;
                self.said += "\n";
                Some(Message::Line(line))
            }
            Ok(Message::Changed) => Some(Message::Changed),
            Ok(Message::Ended) => None,
            Err(_) => panic!("{} does not come; said so far: {}", waiting_for(), self.said),
        }
    }

    /// Waits for a line that contains these words.
    pub fn hear(&mut self, words: &str) {
        let deadline = Instant::now() + DEADLINE;
        loop {
            match self.next(deadline, &|| format!("a line with {words:?}")) {
                Some(Message::Line(line)) if line.contains(words) => return,
                Some(_) => {}
                None => panic!("the program ended without {words:?}: {}", self.said),
            }
        }
    }

    /// Waits until a file of the folder meets a condition, which is checked whenever a file of the folder has changed.
    pub fn wait_for(&mut self, name: &str, condition: impl Fn(&Path) -> bool) {
        let (path, deadline) = (self.folder.join(name), Instant::now() + DEADLINE);
        while !condition(&path) {
            if self.next(deadline, &|| format!("{name:?} as it is wanted")).is_none() {
                // The last change may follow the last check.
                assert!(condition(&path), "the program ended without {name:?}: {}", self.said);
                return;
            }
        }
    }

    /// Kills the program at the n-th change of the folder's files from now on, at once for 0. Returns its exit status
    /// if it ends before that.
    pub fn kill_at_change(&mut self, n: u32) -> Option<ExitStatus> {
        let (mut changes, deadline) = (0, Instant::now() + DEADLINE);
        while changes < n {
            match self.next(deadline, &|| format!("change {n} of the files, after {changes},")) {
                Some(Message::Changed) => changes += 1,
                Some(_) => {}
                None => return Some(self.child.wait().expect("it ends")),
            }
        }
        self.child.kill().expect("it can be killed");
        self.child.wait().expect("it ends");
        None
    }

    /// Asks the program to stop, as Ctrl-C does.
    #[cfg(unix)]
    pub fn interrupt(&self) {
        let kill = Command::new("kill").args(["-INT", &self.id().to_string()]).status().expect("kill runs");
        assert!(kill.success());
    }

    /// Whether the program has ended.
    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_some()
    }

    /// Waits for the end. Returns the exit code and the program's output.
    pub fn end(mut self) -> (Option<i32>, String) {
        let deadline = Instant::now() + DEADLINE;
        while self.next(deadline, &|| "the end".to_owned()).is_some() {}
        let code = self.child.wait().expect("it ends").code();
        (code, std::mem::take(&mut self.said))
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a message for each change of a folder's files until the folder is removed or the receiver dropped. The kernel
/// reports the changes in order: a temporary file is created, written to, and renamed into its place.
#[cfg(target_os = "linux")]
fn watch(folder: &Path, changes: Sender<Message>) {
    use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};
    let queue = inotify::init(CreateFlags::CLOEXEC).expect("inotify");
    inotify::add_watch(&queue, folder, WatchFlags::CREATE | WatchFlags::MODIFY | WatchFlags::MOVED_TO)
        .expect("a folder to watch");
    std::thread::spawn(move || {
        let mut buffer = [std::mem::MaybeUninit::uninit(); 4096];
        let mut events = inotify::Reader::new(queue, &mut buffer);
        // The queue reports the removal of the folder by an "ignored" event.
        while let Ok(event) = events.next()
            && !event.events().contains(ReadFlags::IGNORED)
            && changes.send(Message::Changed).is_ok()
        {}
    });
}

/// The same without inotify: the folder is polled. Changes in fast succession are merged, so that there are fewer
/// moments to kill a program at; tests pass all the same.
#[cfg(not(target_os = "linux"))]
fn watch(folder: &Path, changes: Sender<Message>) {
    let folder = folder.to_path_buf();
    let state = move || {
        let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten();
        let mut files: Vec<_> = entries
            .filter_map(|entry| Some((entry.file_name(), entry.metadata().ok()?)))
            .map(|(name, file)| (name, file.len(), file.modified().ok()))
            .collect();
        files.sort();
        files
    };
    std::thread::spawn(move || {
        let mut before = state();
        loop {
            let now = state();
            // Also as a heartbeat, so that the thread ends with the receiver.
            if now != before && changes.send(Message::Changed).is_err() {
                return;
            }
            before = now;
            std::thread::sleep(Duration::from_millis(1));
        }
    });
}

/// Polls a condition until it holds, for conditions without messages: windows of another process, and a process that is
/// signalled until it ends. This and the folder without inotify are the only
/// sleeps in tests, and no result depends on their length.
pub fn poll(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < DEADLINE, "{what} does not happen");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The number of kills of a test, which is a few by default: more with `STRIDE_KILLS=100`.
pub fn kills(few: u32) -> u32 {
    std::env::var("STRIDE_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(few)
}

/// Runs a program up to `kills` times, and kills each run at one of the first `moments` changes of its files, or before
/// the first. Changes are the only effects of a render on the file system: films and pictures under temporary names,
/// partial or complete, and in their final places. Between two changes there is nothing else to lose, however far apart
/// they are, so that these are all relevant moments. Returns the number of kills; a run that ends by itself
/// is the last.
pub fn kill_at_any_moment(
    folder: &Path,
    kills: u32,
    moments: u32,
    stream: &mut Stream,
    mut command: impl FnMut(&mut Stream) -> Command,
) -> u32 {
    for killed in 0..kills {
        let mut run = Watched::start(command(stream), folder);
        if let Some(status) = run.kill_at_change(stream.random_range(0..=moments)) {
            assert!(status.success(), "{}", run.said());
            return killed;
        }
    }
    kills
}

/// Runs a program that is near its end, killed at the first change of its files, and again, killed at the second, and
/// so on, until it ends by itself: it is killed within each write of its final files. Returns the number of kills.
pub fn kill_at_every_moment(folder: &Path, mut command: impl FnMut() -> Command) -> u32 {
    for moment in 1..1000 {
        let mut run = Watched::start(command(), folder);
        if let Some(status) = run.kill_at_change(moment) {
            assert!(status.success(), "{}", run.said());
            return moment - 1;
        }
    }
    panic!("it never ends");
}
