//! `--stats`: statistics of a run as one JSON object.

use super::failure::with_options;
use crate::session::{DeviceChoice, Report};
use serde::Serialize;
use std::time::Duration;

/// The contents of the file of `--stats`. Times are in seconds.
#[derive(Debug, Serialize)]
pub(super) struct Stats {
    samples: u64,
    resumed_samples: u64,
    spp: f64,
    estimated_noise: Option<f64>,
    /// The requested error, and whether it is known to be reached.
    noise_asked: Option<f64>,
    noise_reached: Option<bool>,
    /// The minimum and the maximum number of samples per pixel.
    spp_range: [u64; 2],
    seconds: f64,
    samples_per_second: f64,
    rays: u64,
    threads: usize,
    device: String,
    devices: Vec<Device>,
    /// The reproducibility of the picture.
    promise: &'static str,
    lost: Option<String>,
    simd: String,
    rejected: u64,
    load_seconds: f64,
    build_seconds: f64,
    accumulator_seconds: f64,
    peak_memory_bytes: Option<u64>,
}

/// A device, and the number of samples it made.
#[derive(Debug, Serialize)]
struct Device {
    name: String,
    samples: u64,
}

impl Stats {
    pub(super) fn new(report: &Report, load: Duration, simd: String, device: &DeviceChoice) -> Stats {
        let promise = match device {
            DeviceChoice::Cpu => "the same bits, on every machine",
            DeviceChoice::Gpu(_) => "the same bits on this device, the same picture statistically on others",
            DeviceChoice::All(_) => "the same picture statistically: who renders which pixel is not fixed",
        };
        let totals = report.totals;
        let seconds = totals.elapsed.as_secs_f64();
        let pixels = f64::from(report.picture.width) * f64::from(report.picture.height);
        Stats {
            samples: totals.samples,
            resumed_samples: totals.before,
            spp: if report.whole { f64::from(totals.spp) } else { totals.samples as f64 / pixels },
            estimated_noise: totals.noise.map(|[now, _]| now),
            noise_asked: report.noise.map(|noise| noise.asked),
            noise_reached: report.noise.map(|noise| noise.reached()),
            spp_range: report.spp_range,
            seconds,
            samples_per_second: totals.made() as f64 / seconds.max(1e-9),
            rays: totals.rays,
            threads: report.threads,
            device: report.device.clone(),
            devices: report.devices.iter().cloned().map(|(name, samples)| Device { name, samples }).collect(),
            promise,
            lost: report.lost.as_deref().map(with_options),
            simd,
            rejected: totals.rejected,
            load_seconds: load.as_secs_f64(),
            build_seconds: report.build.as_secs_f64(),
            accumulator_seconds: totals.adding.as_secs_f64(),
            peak_memory_bytes: peak_memory(),
        }
    }
}

/// The peak memory of the process in bytes, if the system reports it.
fn peak_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
