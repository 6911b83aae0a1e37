//! Merging of ten thousand films.

use super::{bytes, folder, run, succeed};
use rand::RngExt;
use std::fs;
use std::ops::Range;
use std::path::Path;
use std::process::Command;
use stride::film::file::write;
use stride::film::head::Head;
use stride::film::{Film, Identity, Layout, SampleRanges};
use stride::sampling::Stream;

const SHARDS: u32 = 10_000;

/// The length of a note in each header: what a merge must not hold of all films at once.
const NOTE_BYTES: usize = 4096;

/// The most memory that a merge of all films may take beyond that of one film: for their names and samples.
const MOST_MEMORY: u64 = 16 << 20;

const LAYOUT: (u32, u32) = (3, 2);

fn save(folder: &Path, name: &str, film: &Film, samples: Range<u32>) {
    let identity = Identity::default().with("program", "a test").with("size", "3x2");
    let notes = Identity::default()
        .with("exposure", 0)
        .with("tone", "srgb")
        .with("asked", format_args!("{}..{}", samples.start, samples.end))
        .with("parts", "x".repeat(NOTE_BYTES));
    let head = Head { layout: Layout::plain(LAYOUT.0, LAYOUT.1), identity, notes };
    let count = u64::from(samples.end - samples.start);
    let sample_ranges = SampleRanges::prefix(samples, count, count);
    let file = write(Vec::new(), &head, film, &sample_ranges, None).expect("a film");
    fs::write(folder.join(name), file).expect("a file");
}

/// Runs the program, and returns the most memory that it held, in bytes.
fn peak_memory(folder: &Path, arguments: &[&str]) -> Option<u64> {
    const MEASURE: &str = "import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)";
    let mut python = Command::new("python3");
    python.args(["-c", MEASURE, env!("CARGO_BIN_EXE_stride")]).args(arguments).current_dir(folder);
    let Ok(output) = python.output() else {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"), "no python3");
        println!("skipped: no python3");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    // In KiB on Linux, in bytes on macOS.
    let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
    Some(String::from_utf8_lossy(&output.stdout).trim().parse::<u64>().expect("a number") * unit)
}

#[test]
fn ten_thousand_films_merge_in_the_memory_of_one() {
    let dir = folder();
    let stream = &mut Stream::new(19, 0, 0);
    let (width, height) = LAYOUT;
    let mut whole = Film::new(width, height).expect("memory");
    for shard in 0..SHARDS {
        let mut film = Film::new(width, height).expect("memory");
        for pixel in 0..(width * height) as usize {
            // From faint to nearly the brightest, so that sums in floating point would depend on the order.
            let exponent = stream.random_range(-20..28);
            let radiance = [0, 1, 2].map(|_| stream.random_range(0.0_f32..2.0) * 2.0_f32.powi(exponent));
            film.add_sample(pixel, radiance).expect("an accepted sample");
            whole.add_sample(pixel, radiance).expect("an accepted sample");
        }
        save(dir.path(), &format!("{shard}.film"), &film, shard..shard + 1);
    }
    save(dir.path(), "whole.film", &whole, 0..SHARDS);
    let mut order: Vec<u32> = (0..SHARDS).collect();
    (1..order.len()).rev().for_each(|i| order.swap(i, stream.random_range(0..=i)));
    let names: Vec<String> = order.iter().map(|shard| format!("{shard}.film")).collect();
    fn merge<'a>(films: impl IntoIterator<Item = &'a String>, to: &'a str) -> Vec<&'a str> {
        let films = films.into_iter().map(String::as_str);
        ["merge", "-q", "-o", to].into_iter().chain(films).collect()
    }

    let one = peak_memory(dir.path(), &merge(&names[..1], "one.film"));
    let all = peak_memory(dir.path(), &merge(&names, "all.film"));
    if let (Some(one), Some(all)) = (one, all) {
        println!("one film: {} kB, {SHARDS} films: {} kB", one / 1000, all / 1000);
        assert!(all < one + MOST_MEMORY, "{SHARDS} films take {all} bytes, and one takes {one}");
    } else {
        succeed(dir.path(), &merge(&names, "all.film"));
    }
    // The bound is below the size of all headers.
    assert!(u64::from(SHARDS) * NOTE_BYTES as u64 > 2 * MOST_MEMORY);
    let expected = bytes(dir.path(), "whole.film");
    assert!(bytes(dir.path(), "all.film") == expected);

    // By a tree of merges: a hundred films with gaps between all of their samples, then these.
    let groups: Vec<String> = (0..100).map(|group| format!("group-{group}.film")).collect();
    for (first, group) in groups.iter().enumerate() {
        succeed(dir.path(), &merge(names.iter().skip(first).step_by(100), group));
    }
    succeed(dir.path(), &merge(groups.iter().rev(), "tree.film"));
    assert!(bytes(dir.path(), "tree.film") == expected);

    // Negative controls: a film is missing, a film is there twice.
    succeed(dir.path(), &merge(&groups[1..], "part.film"));
    assert!(bytes(dir.path(), "part.film") != expected);
    let twice = run(dir.path(), &merge(groups.iter().chain([&names[150]]), "twice.film"));
    let said = String::from_utf8_lossy(&twice.stderr).into_owned();
    let samples = format!("both have the samples {}..{}", order[150], order[150] + 1);
    assert!(!twice.status.success() && said.contains("group-50.film") && said.contains(&samples), "{said}");
}
