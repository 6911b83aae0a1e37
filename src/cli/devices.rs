//! `stride info --devices`: the devices that can render.

use super::failure::with_options;
use crate::gpu;
use crate::math::lanes::Level;
use std::fmt::Write;

/// The CPU, and each GPU with its name, in which `--device gpu:NAME` searches, as the first line.
pub(super) fn list() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let lanes = Level::from_environment().map_or_else(|error| error.to_string(), |level| level.to_string());
    let mut text = format!("cpu\n  threads     {cores}\n  lanes       {lanes}\n");
    let adapters = gpu::adapters();
    for adapter in &adapters {
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{}\n  kind        {}\n  interface   {}\n  driver      {}\n  table       at most {} MiB\n  \
             workgroup   at most {} invocations\n",
            adapter.name,
            adapter.kind,
            adapter.backend,
            adapter.driver,
            adapter.max_binding >> 20,
            adapter.max_workgroup_size
        );
    }
    if adapters.is_empty()
        && let Err(error) = gpu::Device::open(None)
    {
        let _ = writeln!(text, "{}", with_options(&error.to_string()));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_listed_with_their_limits_or_with_a_remedy() {
        let text = list();
        assert!(text.starts_with("cpu\n  threads "), "{text}");
        match &gpu::adapters()[..] {
            [] => assert!(text.contains("GPU") && text.contains("--device cpu"), "{text}"),
            adapters => {
                for adapter in adapters {
                    assert!(text.contains(&format!("\n{}\n  kind ", adapter.name)), "{text}");
                }
                assert_eq!(text.matches("  table       at most ").count(), adapters.len());
            }
        }
    }
}
