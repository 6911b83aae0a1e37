//! Units that two workers render, and whose results are compared before one is added.

use super::unit::{Posted, Unit};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::time::Duration;

/// The results of units that are being checked.
#[derive(Default)]
pub(super) struct Checks(BTreeMap<u32, Open>);

struct Open {
    first: Posted,
    since: Duration,
}

/// What follows from a result.
pub(super) enum Verdict {
    /// Another worker must render this unit.
    Asks(Unit),
    /// It is the same worker's once more, and is not needed.
    Again(Posted),
    /// Two workers agree: this result is added.
    Agreed(Posted),
    /// Two workers disagree.
    Disagree(Box<[Posted; 2]>),
}

impl Checks {
    /// Whether a unit is among the checked ones: a share of all, which depends on job and unit only.
    pub(super) fn includes(job: &str, first: u32, share: f64) -> bool {
        let digest = Sha256::digest(format!("{job} {first}"));
        let number = u32::from_le_bytes([digest[0], digest[1], digest[2], digest[3]]);
        f64::from(number) < share * 2_f64.powi(32)
    }

    /// Takes a result of a checked unit.
    pub(super) fn take(&mut self, posted: Posted, now: Duration) -> Verdict {
        let key = posted.unit.first;
        let Some(open) = self.0.remove(&key) else {
            let unit = check_of(&posted);
            self.0.insert(key, Open { first: posted, since: now });
            return Verdict::Asks(unit);
        };
        if open.first.worker == posted.worker {
            self.0.insert(key, open);
            return Verdict::Again(posted);
        }
        match open.first.digest == posted.digest {
            // The film of the first one may have been removed to make room.
            true => Verdict::Agreed(posted),
            false => Verdict::Disagree(Box::new([open.first, posted])),
        }
    }

    /// The unit that checks another one which starts at this sample, if its first result is here.
    pub(super) fn asked(&self, first: u32) -> Option<Unit> {
        Some(check_of(&self.0.get(&first)?.first))
    }

    /// Whether this result is the one that waits for its check.
    pub(super) fn holds(&self, posted: &Posted) -> bool {
        self.0.get(&posted.unit.first).is_some_and(|open| open.first.nonce == posted.nonce)
    }

    /// The results that wait for their checks.
    pub(super) fn waiting(&self) -> impl Iterator<Item = &Posted> {
        self.0.values().map(|open| &open.first)
    }

    /// Removes a result that has waited since before this time.
    pub(super) fn take_older(&mut self, before: Duration) -> Option<Posted> {
        let key = self.0.iter().find(|(_, open)| open.since < before).map(|(key, _)| *key)?;
        self.0.remove(&key).map(|open| open.first)
    }

    /// The number of units that are being checked.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

/// The unit that checks a result.
pub(super) fn check_of(first: &Posted) -> Unit {
    Unit { check: 1, not: vec![first.worker.clone()], ..first.unit.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posted(worker: &str, digest: &str) -> Posted {
        Posted {
            unit: Unit::new("j", &(0..4)),
            worker: worker.into(),
            nonce: format!("{worker}{digest}"),
            parts: 1,
            bytes: 1,
            digest: digest.into(),
            seconds: 1.0,
        }
    }

    #[test]
    fn the_share_is_kept() {
        let chosen = |share| (0..10_000).filter(|&first| Checks::includes("j", first, share)).count();
        assert_eq!((chosen(0.0), chosen(1.0)), (0, 10_000));
        // Four standard deviations of a binomial distribution.
        assert!(chosen(0.1).abs_diff(1000) < 120, "{}", chosen(0.1));
    }

    #[test]
    fn results_are_compared_between_workers() {
        let mut checks = Checks::default();
        let zero = Duration::ZERO;
        assert!(matches!(checks.take(posted("a", "1"), zero), Verdict::Asks(unit) if unit.not == ["a"]));
        assert!(matches!(checks.take(posted("a", "1"), zero), Verdict::Again(_)));
        assert!(matches!(checks.take(posted("b", "1"), zero), Verdict::Agreed(p) if p.worker == "b"));
        checks.take(posted("a", "1"), zero);
        assert!(
            matches!(checks.take(posted("b", "2"), zero), Verdict::Disagree(both) if both[1].worker == "b")
        );
        checks.take(posted("a", "1"), zero);
        assert!(checks.take_older(zero).is_none() && checks.take_older(Duration::from_secs(1)).is_some());
    }
}
