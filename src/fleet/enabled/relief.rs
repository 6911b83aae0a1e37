//! What the collector knows of workers that wait for room on the server.

use crate::fleet::FleetError;
use std::collections::BTreeMap;
use std::time::Duration;

/// The time after which a message of a worker that waits no longer counts.
const HEARD: Duration = Duration::from_secs(5);

/// Results without announcements by their places in subjects, with the numbers of their parts.
pub(super) type PartCounts = BTreeMap<String, u64>;

/// What is known of workers that wait for room.
#[derive(Default)]
pub(super) struct Relief {
    /// The time of their last message.
    heard: Option<Duration>,
    /// The last count of parts, and its time.
    counted: Option<(Duration, PartCounts)>,
    /// Whether the last step has added no results.
    is_idle: bool,
}

impl Relief {
    /// A worker waits for room.
    pub(super) fn hear(&mut self, now: Duration) {
        self.heard = Some(now);
    }

    /// Takes note of the result of a step: the server may have no room for messages of the collector either.
    pub(super) fn observe(&mut self, added: &Result<usize, FleetError>, now: Duration) {
        self.is_idle = !matches!(added, Ok(1..));
        if let Err(FleetError::Full(_)) = added {
            self.hear(now);
        }
    }

    /// Whether workers wait for room.
    pub(super) fn is_wanted(&mut self, now: Duration) -> bool {
        let is_wanted = self.heard.is_some_and(|heard| now.saturating_sub(heard) <= HEARD);
        if !is_wanted {
            self.counted = None;
        }
        is_wanted
    }

    /// Whether parts are to be counted: nothing else makes room, and the last count was this long ago.
    pub(super) fn is_count_due(&self, interval: Duration, now: Duration) -> bool {
        self.is_idle && self.counted.as_ref().is_none_or(|(at, _)| now.saturating_sub(*at) >= interval)
    }

    /// Takes a count. Returns the results to which no part was added since the last one; nothing if it is the first.
    pub(super) fn count(&mut self, counts: PartCounts, now: Duration) -> Option<Vec<String>> {
        let (_, before) = self.counted.replace((now, counts.clone()))?;
        let same = counts.into_iter().filter(|(place, count)| before.get(place) == Some(count));
        Some(same.map(|(place, _)| place).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_results_that_do_not_grow_are_given_up() {
        let mut relief = Relief::default();
        let seconds = Duration::from_secs;
        assert!(!relief.is_wanted(seconds(1)));
        relief.observe(&Err(FleetError::Full(String::new())), seconds(1));
        assert!(relief.is_wanted(seconds(6)) && relief.is_count_due(seconds(2), seconds(1)));
        let counts = |a, b| PartCounts::from([("a".into(), a), ("b".into(), b)]);
        assert_eq!(relief.count(counts(1, 1), seconds(1)), None);
        assert!(!relief.is_count_due(seconds(2), seconds(2)) && relief.is_count_due(seconds(2), seconds(3)));
        assert_eq!(relief.count(counts(2, 1), seconds(3)), Some(vec!["b".into()]));
        relief.observe(&Ok(1), seconds(4));
        assert!(!relief.is_count_due(seconds(2), seconds(9)) && !relief.is_wanted(seconds(9)));
    }
}
