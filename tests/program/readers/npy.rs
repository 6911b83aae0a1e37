//! The sample dump as read by NumPy, also after the program was killed.

use super::{python_with, run};
use crate::common::watched::Watched;
use std::process::Command;

use stride::film::Identity;
use stride::output::SampleDump;
use stride::sampling::Sample;

fn sample(i: u32) -> Sample {
    Sample { pixel: i / 4, sample: i % 4, x: i as f32 + 0.5, y: 0.25, radiance: [i as f32, 2.0, 0.1] }
}

/// Text that could confuse a Python parser.
fn facts() -> Identity {
    Identity::default().with("scene", "5eed").with("device", "an \"odd' # name}").with("filter", "tent 1")
}

/// Loads in one line, checks the records against the rule of `sample`, prints their number.
const CHECK: &str = "
import sys, numpy
a = numpy.load(sys.argv[1])
assert a.dtype.itemsize == 28 and a.ndim == 1, (a.dtype, a.shape)
assert a.dtype.names == ('pixel', 'sample', 'x', 'y', 'radiance'), a.dtype
i = numpy.arange(len(a))
assert (a['pixel'] == i // 4).all() and (a['sample'] == i % 4).all()
assert (a['x'] == (i + 0.5).astype('f4')).all() and (a['y'] == 0.25).all()
assert (a['radiance'] == numpy.stack([i, i * 0 + 2, i * 0 + 0.1], 1).astype('f4')).all()
b = numpy.load(sys.argv[1], mmap_mode='r')
assert (a == b).all()
print(len(a))
";

#[test]
fn numpy_opens_a_dump_in_one_line() {
    let Some(python) = python_with("numpy") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    for count in [0, 1, 100_000] {
        let mut dump = SampleDump::create(&path, &facts()).unwrap();
        dump.write(&(0..count).map(sample).collect::<Vec<_>>()).unwrap();
        assert_eq!(dump.finish().unwrap(), u64::from(count));
        assert_eq!(run(&python, CHECK, &[&path]).expect("it holds"), count.to_string());
    }

    // Negative control: a wrong record is detected.
    let mut dump = SampleDump::create(&path, &facts()).unwrap();
    dump.write(&[sample(0), Sample { y: 0.5, ..sample(1) }]).unwrap();
    dump.finish().unwrap();
    assert!(run(&python, CHECK, &[&path]).unwrap_err().contains("AssertionError"));
}

/// Loads the dump of a render, checks that no sample occurs twice, prints their number.
const CHECK_RENDER: &str = "
import sys, numpy
a = numpy.load(sys.argv[1])
assert a.dtype.itemsize == 28 and a.ndim == 1, (a.dtype, a.shape)
key = a['pixel'].astype('u8') << 32 | a['sample']
assert len(numpy.unique(key)) == len(a)
assert a['pixel'].max() < 320 * 240 and a['x'].max() <= 321 and a['radiance'].min() >= 0
print(len(a))
";

#[test]
fn a_killed_run_leaves_a_dump_that_loads() {
    let folder = tempfile::tempdir().unwrap();
    for (round, wait_for) in [3_000_000u64, 5_555_555, 8_000_001].into_iter().enumerate() {
        let name = format!("{round}.npy");
        let path = folder.path().join(&name);
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml");
        let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
        command
            .args([
                "render",
                scene,
                "--headless",
                "--quiet",
                "--spp",
                "1000000",
                "--size",
                "320x240",
                "--samples",
            ])
            .arg(&path)
            .current_dir(folder.path());
        let mut child = Watched::start(command, folder.path());
        child.wait_for(&name, |path| std::fs::metadata(path).map_or(0, |file| file.len()) >= wait_for);
        // After the records or after their count in the header, depending on the write.
        assert!(child.kill_at_change(round as u32).is_none());

        let file = std::fs::read(&path).unwrap();
        let header = String::from_utf8_lossy(&file[..192]).into_owned();
        let count: usize =
            header.split("'shape': (").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
        let there = (file.len() - 192) / 28;
        assert!(count <= there, "the header promises {count} samples, {there} are there");
        // A flush writes all samples since the last one: a mebibyte, and the rest of the batch.
        assert!(there - count <= (2 << 20) / 28, "{there} samples are there, the header knows of {count}");
        assert!(count > 50_000);
        if let Some(python) = python_with("numpy") {
            assert_eq!(run(&python, CHECK_RENDER, &[&path]).expect("it holds"), count.to_string());
        }
    }
}
