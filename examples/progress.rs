//! Renders a scene file with its own progress bar, for at most ten seconds, and writes the picture:
//!
//! ```sh
//! cargo run --release --example progress -- scenes/cover.toml cover.png
//! ```

use std::io::Write;
use stride::{Error, Event, Render, RenderHandle, Report, Scene};

const WIDTH: usize = 40;

/// Draws a progress bar, and stops the render after `seconds`.
pub fn watch(mut render: RenderHandle, seconds: f64, out: &mut impl Write) -> Result<Report, Error> {
    for event in render.events() {
        // The render continues without a terminal.
        let _ = match event {
            Event::Progress(progress) => {
                if progress.seconds > seconds {
                    render.stop();
                }
                let done = (progress.fraction().unwrap_or(0.0) * WIDTH as f64) as usize;
                write!(out, "\r[{:WIDTH$}] {progress}  ", "=".repeat(done))
            }
            Event::Ended(progress) => writeln!(out, "\n{}", progress.summary()),
            Event::Note(note) => writeln!(out, "\n{note}"),
            _ => Ok(()),
        };
    }
    render.join()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(scene), Some(picture)) = (arguments.next(), arguments.next()) else {
        return Err("name a scene and a picture".into());
    };
    let render = Render::new(&Scene::load(scene)?).start()?;
    Ok(watch(render, 10.0, &mut std::io::stderr())?.save(picture)?)
}
