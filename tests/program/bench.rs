//! `stride bench`, by the command line: small films and few samples, so that each test takes about a second.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn cover() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cover.toml")
}

fn command(what: &str, more: &str, folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.current_dir(folder).args(["bench", what]).arg(cover()).args(more.split_whitespace());
    command
}

fn bench(what: &str, more: &str, folder: &Path) -> Output {
    command(what, more, folder).output().unwrap()
}

/// Runs to the end and returns the standard output.
fn done(what: &str, more: &str, folder: &Path) -> String {
    let output = bench(what, more, folder);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    String::from_utf8(output.stdout).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Header and rows; an empty cell is NaN.
fn csv(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(number).collect()).collect();
    assert!(rows.iter().all(|row| row.len() == names.len()), "{text}");
    (names, rows)
}

/// A column of a table of errors for one sampler.
fn column(path: &Path, sampler: &str, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let at = lines[0].iter().position(|heading| *heading == name).unwrap();
    assert_eq!(lines[0][0], "sampler");
    lines[1..].iter().filter(|row| row[0] == sampler).map(|row| row[at].parse().unwrap()).collect()
}

/// Parses the chart and returns its number of dots, without the legend's.
fn dots(path: &Path) -> usize {
    let text = fs::read_to_string(path).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    assert_eq!(document.root_element().tag_name().name(), "svg");
    let circles =
        document.descendants().filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "circle")));
    circles.filter(|circle| circle.first_element_child().is_some()).count()
}

#[test]
fn threads_prints_the_reports_table() {
    let folder = tempfile::tempdir().unwrap();
    let text = done(
        "threads",
        "--threads 2,1,2 --spp 2 --size 32x24 --repeat 2 --csv t.csv --plot t.svg",
        folder.path(),
    );
    for word in ["cover.toml", "32×24", "Threads", "Time × threads", "Efficiency", "100.0%"] {
        assert!(text.contains(word), "{word:?} is not in\n{text}");
    }
    let (names, rows) = csv(&folder.path().join("t.csv"));
    assert_eq!(names[..3], ["threads", "seconds", "seconds_times_threads"]);
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [1.0, 2.0]);
    for row in &rows {
        let [threads, seconds, product, rate] = row[..4] else { panic!("{row:?}") };
        assert!((threads * seconds - product).abs() < 1e-9);
        assert!((rate * seconds - 2.0 * 32.0 * 24.0).abs() < 1e-3, "{row:?}");
        let [fastest, slowest, runs] = row[5..] else { panic!("{row:?}") };
        assert!(fastest <= seconds && seconds <= slowest && runs == 2.0, "{row:?}");
    }
    assert_eq!(dots(&folder.path().join("t.svg")), 2);
}

#[test]
fn depth_prints_the_reports_table() {
    let folder = tempfile::tempdir().unwrap();
    let text = done(
        "depth",
        "--depths 0,2,3 --spp 2 --size 32x24 --repeat 1 --csv d.csv --plot d.svg",
        folder.path(),
    );
    assert!(text.contains("Time ÷ depth"), "{text}");
    let (names, rows) = csv(&folder.path().join("d.csv"));
    assert_eq!(names[..3], ["depth", "seconds", "seconds_per_depth"]);
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [0.0, 2.0, 3.0]);
    assert!(rows[0][2].is_nan() && (rows[1][2] * 2.0 - rows[1][1]).abs() < 1e-9);
    // A path of more bounces has more rays.
    assert!(rows[0][4] < rows[1][4] && rows[1][4] < rows[2][4], "{rows:?}");
    assert_eq!(dots(&folder.path().join("d.svg")), 3);
}

// The mean squared error of independent samples is exactly proportional to 1/n; the measured one is its mean over
// 48·36 pixels, few of whose paths find the light. Eight seeds gave slopes from −0.467 to −0.531 with a standard
// deviation of 0.024, four of which are a tenth; the reference's own error, n/512 of the variance, bends the line by
// 0.004. An estimator that does not converge, or shares its samples with the reference, deviates more.
#[test]
fn the_error_falls_with_the_root_of_the_number_of_samples() {
    let folder = tempfile::tempdir().unwrap();
    let text = done(
        "noise",
        "--spp 40 --size 48x36 --reference-spp 512 --repeat 1 --integrator path-naive --sampler independent --csv n.csv --plot n.svg",
        folder.path(),
    );
    let file = folder.path().join("n.csv");
    let column = |name| column(&file, "independent", name);
    let (spp, errors) = (column("spp"), column("rms_error"));
    assert_eq!(spp, [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
    let said =
        text.split("Slope of independent from 1 to 32 samples: ").nth(1).unwrap().split(' ').next().unwrap();
    let slope: f64 = said.replace('−', "-").parse().unwrap();
    assert!((slope + 0.5).abs() < 0.1, "{text}");
    // The printed slope matches the file: least squares over logarithms, by a different formula.
    let logs = spp.iter().zip(&errors).map(|(x, y)| (x.log2(), y.log2()));
    let (weighted, squares) =
        logs.fold((0.0, 0.0), |(w, s), (x, y)| (w + (x - 2.5) * y, s + (x - 2.5) * (x - 2.5)));
    assert!((weighted / squares - slope).abs() < 1e-3);
    let rest = column("rms_error_without_worst");
    assert!(
        rest.iter().zip(&errors).all(|(rest, all)| rest < all),
        "the worst pixels are still there: {rest:?}"
    );
    // So do the local slopes, and the slope in the file: of all powers of two from 1 on.
    let table = fs::read_to_string(&file).unwrap();
    let local: Vec<f64> = (1..6).map(|i| (errors[i] / errors[i - 1]).log2()).collect();
    for (i, line) in table.lines().skip(1).enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let at = |name: &str| table.lines().next().unwrap().split(',').position(|n| n == name).unwrap();
        let found = |name: &str| cells[at(name)].parse::<f64>().ok();
        assert_eq!(found("local_slope").is_some(), i > 0);
        assert!(i == 0 || (found("local_slope").unwrap() - local[i - 1]).abs() < 1e-9, "{line}");
        assert!((found("slope").unwrap() - weighted / squares).abs() < 1e-9, "{line}");
        assert_eq!((found("slope_from_spp"), found("slope_standard_error")), (Some(1.0), None));
    }
    assert!(text.contains("Reference: rendered, 512 samples per pixel, sobol, seed 2654435769\n"), "{text}");
    assert!(fs::read_to_string(folder.path().join("n.svg")).unwrap().contains("rendered, 512 samples"));
    assert!(text.contains("no ± with --repeat 1"), "{text}");
    assert_eq!(dots(&folder.path().join("n.svg")), 6);
}

const SMALL: &str = "--spp 4 --size 24x18 --seed 5";

#[test]
fn several_samplers_are_in_one_table_and_one_chart() {
    let folder = tempfile::tempdir().unwrap();
    let table = |more: &str, file: &str| {
        let reference = "--reference-spp 64 --repeat 2";
        let text =
            done("noise", &format!("{SMALL} {reference} {more} --csv {file} --plot n.svg"), folder.path());
        (text, fs::read_to_string(folder.path().join(file)).unwrap())
    };
    let (text, both) = table("--sampler sobol,independent", "n.csv");
    for words in
        ["Slope of sobol", "Slope of independent", "· sobol, independent ·", "± is the standard error"]
    {
        assert!(text.contains(words), "{words:?} is not in\n{text}");
    }
    assert_eq!(dots(&folder.path().join("n.svg")), 6);
    // Of whichever is better here.
    assert!(text.contains("times fewer samples than") && !text.contains("less time"), "{text}");
    assert!(!both.contains("seconds"), "{both}");
    // Each part is the table of that sampler alone: all have the same reference.
    let parts = ["sobol", "independent"].map(|sampler| table(&format!("--sampler {sampler}"), "alone.csv").1);
    let rows = parts[1].split_once('\n').unwrap().1;
    assert_eq!(both, parts[0].clone() + rows);
    assert_ne!(parts[0], parts[1]);
    assert!(!table("--sampler sobol", "alone.csv").0.contains("fewer"));
}

#[test]
fn times_are_measured_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let text = done(
        "noise",
        &format!(
            "{SMALL} --reference-spp 64 --repeat 2 --sampler sobol,independent --times --csv n.csv --plot n.svg"
        ),
        folder.path(),
    );
    assert!(text.contains("they differ from run to run"), "{text}");
    let file = folder.path().join("n.csv");
    for sampler in ["sobol", "independent"] {
        let seconds = column(&file, sampler, "seconds");
        assert!(seconds.len() == 3 && seconds.iter().all(|&s| s > 0.0), "{seconds:?}");
    }
    assert!(
        fs::read_to_string(folder.path().join("n.svg")).unwrap().contains("Measured time of a picture (s)")
    );
    assert_eq!(dots(&folder.path().join("n.svg")), 6);
}

#[test]
fn a_reference_from_a_file_replaces_the_rendered_one() {
    let folder = tempfile::tempdir().unwrap();
    // The seed of the built-in reference is that of the scene and 0x9e3779b9 more.
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .current_dir(folder.path())
        .arg("render")
        .arg(cover())
        .args("--headless -q --spp 64 --size 24x18 --seed 2654435774 -o r.exr".split(' '))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let sampler = "--repeat 2 --sampler independent --first-spp 2";
    let text = done("noise", &format!("{SMALL} {sampler} --reference r.exr --csv file.csv"), folder.path());
    assert!(text.contains("Reference: r.exr, 64 samples per pixel, sobol, seed 2654435774\n"), "{text}");
    assert!(text.contains("Slope of independent from 2 to 4 samples: none"), "{text}");
    done("noise", &format!("{SMALL} {sampler} --reference-spp 64 --csv built-in.csv"), folder.path());
    done("noise", &format!("{SMALL} {sampler} --reference-spp 65 --csv other.csv"), folder.path());
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("file.csv"), read("built-in.csv"));
    assert_ne!(read("file.csv"), read("other.csv"));
}

#[test]
fn standard_errors_are_those_of_independent_seeds() {
    let folder = tempfile::tempdir().unwrap();
    exr::prelude::write_rgb_file(folder.path().join("r.exr"), 24, 18, |_, _| (0.1f32, 0.1f32, 0.1f32))
        .unwrap();
    let errors = |seed: u32, repeat: u32, name: &str| {
        let arguments = "--spp 4 --size 24x18 --sampler sobol --reference r.exr --csv n.csv";
        done("noise", &format!("{arguments} --seed {seed} --repeat {repeat}"), folder.path());
        let file = folder.path().join("n.csv");
        // One seed has no standard error: the fields are empty, those of slopes and those of errors.
        for column in ["rms_error_standard_error", "slope_standard_error"] {
            let text = fs::read_to_string(&file).unwrap();
            let at = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
            let is_empty = |line: &str| line.split(',').nth(at).unwrap().is_empty();
            assert!(text.lines().skip(1).all(|line| is_empty(line) == (repeat == 1)), "{column}: {text}");
        }
        column(&file, "sobol", name)
    };
    let alone: Vec<Vec<f64>> = (5..8).map(|seed| errors(seed, 1, "rms_error")).collect();
    let (all, deviations) = (errors(5, 3, "rms_error"), errors(5, 3, "rms_error_standard_error"));
    for row in 0..3 {
        let squares: Vec<f64> = alone.iter().map(|errors| errors[row] * errors[row]).collect();
        let total: f64 = squares.iter().sum();
        assert!(((total / 3.0).sqrt() / all[row] - 1.0).abs() < 1e-9);
        let others: Vec<f64> = squares.iter().map(|square| ((total - square) / 2.0).sqrt()).collect();
        let mean = others.iter().sum::<f64>() / 3.0;
        let spread: f64 = others.iter().map(|other| (other - mean).powi(2)).sum();
        let expected = (spread * 2.0 / 3.0).sqrt();
        assert!(
            expected > 0.0 && (deviations[row] / expected - 1.0).abs() < 1e-6,
            "{deviations:?}, {expected}"
        );
    }
}

#[test]
fn unsuitable_references_are_rejected() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    write_rgb_file(file("other.exr"), 32, 18, |_, _| (0.1f32, 0.1f32, 0.1f32)).unwrap();
    write_rgb_file(file("nan.exr"), 24, 18, |x, y| {
        (if (x, y) == (3, 2) { f32::NAN } else { 0.1 }, 0.1f32, 0.1f32)
    })
    .unwrap();
    let grey = SpecificChannels::build().with_channel("Y").with_pixel_fn(|_| (0.5f32,));
    Image::from_channels((24, 18), grey).write().to_file(file("grey.exr")).unwrap();
    fs::write(file("broken.exr"), b"no picture").unwrap();
    for (more, code, words) in [
        (
            "--reference other.exr",
            1,
            "other.exr has 32×18 pixels, but the scene is measured at 24×18; give --size 32x18",
        ),
        ("--reference nan.exr", 1, "pixel 3,2 of the reference nan.exr is NaN or infinite"),
        ("--reference grey.exr", 1, "no channels R, G and B at full resolution, only Y"),
        ("--reference broken.exr", 1, "not a complete"),
        ("--reference missing.exr", 1, "there is no such file"),
        ("--reference a.png", 2, "a reference is OpenEXR"),
        ("--reference other.exr --reference-spp 64", 2, "cannot be used with"),
        ("--sampler sobol,sobol", 2, "sobol is named twice"),
        ("--sampler sobol,halton", 2, "unknown sampler \"halton\"; there is \"sobol\", which is pbrt's"),
        ("--sampler zsobol", 2, "unknown sampler \"zsobol\"; there is \"sobol\", which is pbrt's"),
        ("--sampler paddedsobol", 2, "unknown sampler \"paddedsobol\"; did you mean \"sobol\"?"),
    ] {
        let output = bench("noise", &format!("{SMALL} {more} --csv n.csv"), folder.path());
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{more}: {said}");
        assert!(said.contains(words), "{more}: {said}");
        assert!(output.stdout.is_empty() && !file("n.csv").exists());
    }
    // Only comparisons of errors take several samplers.
    let output = bench("threads", "--sampler sobol,independent", folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}

#[test]
fn the_metadata_of_a_reference_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let render = |scene: &str, more: &str| {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
        let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
        let command = command.current_dir(folder.path()).arg("render").arg(scene);
        let command = command.args("--headless -q -o r.exr".split(' '));
        let output = command.args(more.split_whitespace()).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
    };
    let measure = || {
        let arguments =
            "--spp 1 --size 24x18 --seed 5 --repeat 2 --sampler sobol,independent --reference r.exr";
        bench("noise", arguments, folder.path())
    };
    let size = "--spp 1 --size 24x18";
    for (scene, settings, words) in [
        (
            "cover.toml",
            format!("{size} --seed 6"),
            "shares samples with measured pictures: sobol with the seed 6",
        ),
        (
            "room.toml",
            format!("{size} --seed 9"),
            "the reference r.exr is of another scene: its fingerprint is ",
        ),
        ("cover.toml", format!("{size} --seed 9 --filter gaussian"), "its filter is gaussian"),
        ("cover.toml", format!("{size} --seed 9 --max-depth 1"), "its max depth is 1, not "),
        ("cover.toml", format!("{size} --seed 9 --integrator whitted"), "is of the integrator whitted"),
        (
            "cover.toml",
            "--spp 1 --size 48x36 --crop 3,4,24,18 --seed 9".to_owned(),
            "its size is 48x36, not 24x18",
        ),
    ] {
        render(scene, &settings);
        let output = measure();
        assert_eq!(output.status.code(), Some(1), "{settings}: {}", stderr(&output));
        assert!(stderr(&output).contains(words), "{settings}: {}", stderr(&output));
        assert!(output.stdout.is_empty());
    }
    // Negative control, with another integrator of the same expectation. Few samples only cause a warning.
    render("cover.toml", &format!("{size} --seed 9 --integrator path-naive"));
    let output = measure();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("about 41.4% to the error at 1; give it 32 or more"), "{said}");
    assert!(!said.contains("does not state"), "{said}");
    // A picture of another program has no metadata.
    exr::prelude::write_rgb_file(folder.path().join("r.exr"), 24, 18, |_, _| (0.1f32, 0.1f32, 0.1f32))
        .unwrap();
    let output = measure();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("r.exr does not state: scene, size, crop, filter"),
        "{}",
        stderr(&output)
    );
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("Reference: r.exr, unknown samples per pixel"), "{text}");
}

#[test]
fn standard_error_is_empty_only_with_quiet() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "--threads 1 --spp 1 --size 8x8 --repeat 1";
    assert!(stderr(&bench("threads", arguments, folder.path())).contains("1 thread, run 1 of 1"));
    assert_eq!(stderr(&bench("threads", &format!("{arguments} --quiet"), folder.path())), "");
}

#[test]
fn unwritable_files_are_detected_before_measuring() {
    let folder = tempfile::tempdir().unwrap();
    // Measuring this would take hours.
    let long = "--spp 10000000 --threads 1";
    for (file, words) in
        [("--plot no/such/a.svg", "no/such"), ("--csv no/such/a.csv", "no/such"), ("--csv .", "folder")]
    {
        let output = bench("threads", &format!("{long} {file}"), folder.path());
        assert_eq!(output.status.code(), Some(1), "{file}: {}", stderr(&output));
        assert!(stderr(&output).contains(words), "{file}: {}", stderr(&output));
        assert!(output.stdout.is_empty());
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn bad_usage_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    for (what, arguments, words) in [
        ("threads", "--threads 0", "0"),
        ("threads", "--threads 1,x", "x"),
        ("threads", "--threads 100 --size 4x4", "16 pixels"),
        ("threads", "--plot a.png", ".svg"),
        ("threads", "--plot a.svg --csv a.svg", "both"),
        ("threads", "--spp 0", "0"),
        ("threads", "--repeat 0", "0"),
        ("depth", "--max-depth 3", "--depths"),
        ("depth", "--depths -1", "-1"),
        ("noise", "--spp 64 --reference-spp 64", "too small"),
        ("noise", "--spp 16 --first-spp 17", "--first-spp 17 is above the largest measured number, 16"),
        ("speed", "", "speed"),
    ] {
        let output = bench(what, arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{what} {arguments}: {}", stderr(&output));
        assert!(stderr(&output).contains(words), "{what} {arguments}: {}", stderr(&output));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_closed_pipe_is_an_error_and_not_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = command("threads", "--threads 1 --spp 1 --size 8x8 --csv t.csv", folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(said.contains("standard output") && !said.contains("panicked"), "{said}");
    // The measurements are not lost with it.
    assert_eq!(csv(&folder.path().join("t.csv")).1.len(), 1);
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_finished_measurements() {
    use std::io::{BufRead, BufReader};
    let folder = tempfile::tempdir().unwrap();
    // So many rounds would take a minute.
    let mut child =
        command("threads", "--threads 1 --spp 20 --size 160x120 --repeat 1000 --csv t.csv", folder.path())
            .args(["--integrator", "path-naive"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("1 thread") {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0, "it ended before the first run");
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    // Its output is read until it ends.
    let _ = said.lines().count();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let runs = csv(&folder.path().join("t.csv")).1[0][7];
    assert!((1.0..1000.0).contains(&runs), "{runs}");
}
