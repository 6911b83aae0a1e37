//! Progress of reading the files of a scene.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::path::Path;
use std::time::{Duration, Instant};

/// The progress of reading the files of a scene: a bar on a terminal, if it takes longer than a moment.
pub(super) struct Loading(Option<ProgressBar>);

/// The time after which the bar appears.
const PATIENCE: Duration = Duration::from_millis(300);

impl Loading {
    /// On standard error; nothing if that is not a terminal, or with `quiet`.
    pub(super) fn stderr(quiet: bool) -> Loading {
        let bar = (!quiet).then(|| ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()));
        Loading(bar.filter(|bar| !bar.is_hidden()))
    }

    /// A callback for the progress: the file, the bytes read, and the total.
    pub(super) fn watch(&self) -> impl FnMut(&Path, u64, u64) + '_ {
        let start = Instant::now();
        move |path, bytes, of| {
            let Some(bar) = &self.0 else { return };
            if start.elapsed() > PATIENCE {
                let style = ProgressStyle::with_template("reading {msg} {wide_bar} {bytes}/{total_bytes}");
                bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
                bar.set_message(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
                bar.set_length(of);
                bar.set_position(bytes);
            }
        }
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
