//! Texts from the network: those of workers, and parts of malformed messages.

use std::collections::BTreeSet;

/// The most characters of a text.
const LONGEST: usize = 300;

/// The most notes that are shown.
const MOST: usize = 100;

/// A text as one line without control characters, shortened.
pub(super) fn plain(text: &str) -> String {
    let clean = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let mut line: String = text.chars().take(LONGEST).map(clean).collect();
    if text.chars().nth(LONGEST).is_some() {
        line.push('…');
    }
    line
}

/// Notes of workers that have been shown.
#[derive(Default)]
pub(super) struct Notes(BTreeSet<String>);

impl Notes {
    /// The line to show; nothing if a note of this worker and kind was shown before. A worker sends one with each attempt,
    /// and the numbers in them differ.
    pub(super) fn take(&mut self, text: &[u8]) -> Option<String> {
        let line = plain(&String::from_utf8_lossy(text));
        let kind = line.strip_prefix("warning: ").unwrap_or(&line);
        let kind = kind.split_once(": ").map_or(kind, |(kind, _)| kind).to_owned();
        (self.0.len() < MOST && self.0.insert(kind)).then_some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_from_the_network_are_short_lines() {
        assert_eq!(plain("a\x1b[2J\nb"), "a\u{fffd}[2J\u{fffd}b");
        assert_eq!(
            (plain(&"x".repeat(LONGEST)).len(), plain(&"x".repeat(LONGEST + 1)).chars().count()),
            (LONGEST, LONGEST + 1)
        );
        assert!(plain(&"x".repeat(LONGEST + 1)).ends_with('…'));
    }

    #[test]
    fn notes_are_shown_once_for_each_worker_and_kind() {
        let mut notes = Notes::default();
        let mut is_shown = |text: &str| notes.take(text.as_bytes()).is_some();
        assert!(is_shown("worker a waits with a result: 5 of 9 bytes"));
        assert!(!is_shown("worker a waits with a result: 6 of 9 bytes"));
        assert!(is_shown("worker b waits with a result: 6 of 9 bytes"));
        assert!(is_shown("warning: worker a does not render job j: disk half1"));
        assert!(!is_shown("warning: worker a does not render job j: disk half2"));
        assert_eq!((0..200).filter(|i| is_shown(&format!("worker {i}"))).count(), MOST - 3);
    }
}
