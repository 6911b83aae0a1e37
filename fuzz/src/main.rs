//! Fuzzes a reader for some seconds. The same seed gives the same files.
//!
//! ```sh
//! cargo run -p stride-fuzz --profile fuzz -- glb 600 1
//! STRIDE=target/release/stride cargo run -p stride-fuzz --profile fuzz -- film 600 1
//! cargo run -p stride-fuzz --profile fuzz -- obj FILE       # reads a file that was found
//! ```
//!
//! Readers are compiled with overflow checks and assertions, so that their violations are panics.
//!
//! A mutated file starts from a file in `fuzz/seeds`, or from one that this program or another writes. Bytes, numbers,
//! lines and brackets are changed, removed, duplicated, exchanged and copied from other files. Lengths and checksums are
//! mostly corrected afterwards. Files that a reader accepts are mutated further.
//!
//! A reader must return a result or an error. These are faults: a panic, a time of more than ten seconds, and more memory
//! than a multiple of the file's size. Files with faults are stored in the folder `stride-fuzz` of the system's folder for
//! temporary files, for panics one for each place in the code; so is the slowest file. If a reader aborts the program or
//! does not return within a minute, its file is there as `last`.

mod memory;
mod pictures;
mod spoil;
mod targets;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc;
use std::time::{Duration, Instant};
use targets::Target;

/// The time limit for a file. It must be exceeded twice.
const SLOW: Duration = Duration::from_secs(10);

/// The time after which a reader counts as hanging.
const ENDLESS: Duration = Duration::from_secs(60);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let target = arguments.first().and_then(|name| targets::target(name));
    let (second, third) = (arguments.get(1).map(String::as_str), arguments.get(2).map(String::as_str));
    let number = |text: Option<&str>, default: u64| text.map_or(Some(default), |text| text.parse().ok());
    let found = match (target, number(second, 60), number(third, 1), second) {
        (Some(target), Some(seconds), Some(seed), _) => search(target, Duration::from_secs(seconds), seed),
        (Some(target), None, _, Some(file)) => again(&target, Path::new(file)),
        _ => {
            eprintln!("usage: stride-fuzz {} [SECONDS] [SEED]", targets::NAMES.join("|"));
            eprintln!("       stride-fuzz READER FILE");
            return ExitCode::from(2);
        }
    };
    if found == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The outcome of reading a file.
struct Answer {
    taken: bool,
    time: Duration,
    memory: usize,
    /// The fault, if there was one.
    fault: Option<String>,
}

fn ask(target: &Target, bytes: &[u8]) -> Answer {
    let began = Instant::now();
    let (result, memory) = memory::measured(|| catch_unwind(AssertUnwindSafe(|| (target.read)(bytes))));
    let mut time = began.elapsed();
    if time > SLOW && result.is_ok() {
        // Another program may have used the processor.
        let again = Instant::now();
        (target.read)(bytes);
        time = time.min(again.elapsed());
    }
    let [base, each] = target.memory;
    let most = base + each * bytes.len();
    let fault = match &result {
        Err(_) => Some("panic".to_owned()),
        Ok(_) if time > SLOW => Some(format!("slow: {time:?}")),
        Ok(_) if memory > most => {
            Some(format!("large: {memory} bytes of memory for {} of file", bytes.len()))
        }
        Ok(_) => None,
    };
    Answer { taken: result.unwrap_or(false), time, memory, fault }
}

/// Reads one file, such as one that was found.
fn again(target: &Target, file: &Path) -> usize {
    let bytes = std::fs::read(file).expect("a file");
    let Answer { taken, time, memory, fault } = ask(target, &bytes);
    println!("taken: {taken}, {time:?}, {memory} bytes of memory, fault: {fault:?}");
    usize::from(fault.is_some())
}

/// Ends the program if the loop sends no message for a minute.
fn watch(last: PathBuf) -> mpsc::Sender<()> {
    let (goes_on, heard) = mpsc::channel();
    std::thread::spawn(move || {
        loop {
            match heard.recv_timeout(ENDLESS) {
                Ok(()) => {}
                Err(mpsc::RecvTimeoutError::Disconnected) => return,
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    eprintln!("{}: no answer within {ENDLESS:?}", last.display());
                    std::process::exit(1);
                }
            }
        }
    });
    goes_on
}

/// Searches for faults, and returns their number.
fn search(target: Target, seconds: Duration, seed: u64) -> usize {
    let folder = std::env::temp_dir().join("stride-fuzz");
    std::fs::create_dir_all(&folder).expect("a folder for what is found");
    let last = folder.join(format!("last.{}", target.name));
    let goes_on = watch(last.clone());
    // The places of panics: each place in the code is reported once.
    let (panics, places) = mpsc::channel();
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let _ = panics.send((info.location().map(ToString::to_string), info.to_string()));
    }));

    let random = &mut Pcg64::seed_from_u64(seed);
    let mut told = BTreeSet::new();
    let mut tell = |bytes: &[u8], fault: &str| {
        let (kind, more) = match places.try_iter().next() {
            Some((place, text)) => (place.unwrap_or_default(), text),
            None => (fault.split(':').next().unwrap_or_default().to_owned(), fault.to_owned()),
        };
        if told.insert(kind) {
            let path = folder.join(format!("{}-{seed}-{}.{}", target.name, told.len(), target.name));
            std::fs::write(&path, bytes).expect("what was found");
            eprintln!("{}: {more}", path.display());
        }
        told.len()
    };
    let (mut pool, mut found) = (target.seeds.clone(), 0);
    let seeds = pool.len();
    let (mut runs, mut taken) = (0_u64, 0_u64);
    let (mut slowest, mut most) = (Duration::ZERO, 0);
    let mut try_one = |bytes: &[u8]| {
        std::fs::write(&last, bytes).expect("the file that is tried");
        let _ = goes_on.send(());
        let answer = ask(&target, bytes);
        if answer.time > slowest {
            slowest = answer.time;
            std::fs::write(folder.join(format!("slowest.{}", target.name)), bytes).expect("the slowest file");
        }
        most = most.max(answer.memory);
        if let Some(fault) = &answer.fault {
            found = tell(bytes, fault);
        }
        answer.taken
    };
    let good = target.seeds.iter().filter(|seed| try_one(seed)).count();
    let start = Instant::now();
    while start.elapsed() < seconds {
        let mut bytes = pool[random.random_range(0..pool.len())].clone();
        let other = pool[random.random_range(0..pool.len())].clone();
        for _ in 0..1 << random.random_range(0..4) {
            spoil::spoil(&mut bytes, &other, target.words, random);
        }
        if random.random_range(0..4) > 0 {
            (target.mend)(&mut bytes);
        }
        runs += 1;
        if try_one(&bytes) {
            taken += 1;
            // All seeds stay; other files replace each other.
            if pool.len() < seeds + 256 {
                pool.push(bytes);
            } else {
                let at = random.random_range(seeds..pool.len());
                pool[at] = bytes;
            }
        }
    }
    std::panic::set_hook(usual);
    println!(
        "{}: {good} of {seeds} seeds are good; {runs} files, {taken} taken; at most {slowest:?} and {most} bytes of \
         memory; {found} faults; seed {seed}",
        target.name
    );
    found
}
