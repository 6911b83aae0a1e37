//! The ranges of samples that a film contains.
#![allow(clippy::single_range_in_vec_init, reason = "this module is about lists of ranges")]

use super::layer_set::LAYER_SAMPLES;
use std::fmt;
use std::ops::Range;

/// The indices of the samples in a film: ranges that every pixel has completely, and at most one open range, of which
/// each pixel has the first samples only.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampleRanges {
    /// Ascending, not empty, with gaps between them.
    whole: Vec<Range<u32>>,
    /// Each pixel has as many of these, from the first on, as its count exceeds the whole ranges.
    open: Option<Range<u32>>,
}

impl SampleRanges {
    /// The ranges of a film whose pixels have between `least` and `most` samples of `range`, from its first on.
    pub fn prefix(range: Range<u32>, least: u64, most: u64) -> SampleRanges {
        let in_range = |n: u64| u32::try_from(n).unwrap_or(u32::MAX).min(range.end - range.start);
        let (least, most) = (in_range(least), in_range(most));
        let begun = range.start + least;
        let whole = if least > 0 { vec![range.start..begun] } else { Vec::new() };
        SampleRanges { whole, open: (most > least).then_some(begun..range.end) }
    }

    /// The ranges of a file; `None` if they are out of order, empty, or overlap.
    pub(super) fn new(whole: Vec<Range<u32>>, open: Option<Range<u32>>) -> Option<SampleRanges> {
        let ordered = whole.windows(2).all(|pair| pair[0].end < pair[1].start);
        let filled = whole.iter().chain(&open).all(|range| range.start < range.end);
        let apart = |open: &Range<u32>| whole.iter().all(|range| common(range, open).is_empty());
        (ordered && filled && open.as_ref().is_none_or(apart)).then_some(SampleRanges { whole, open })
    }

    /// The ranges that every pixel has completely, in ascending order.
    pub fn whole(&self) -> &[Range<u32>] {
        &self.whole
    }

    /// The range that pixels have only in part, if there is one.
    pub fn open(&self) -> Option<&Range<u32>> {
        self.open.as_ref()
    }

    /// The minimum number of samples per pixel.
    pub fn least(&self) -> u64 {
        self.whole.iter().map(|range| u64::from(range.end - range.start)).sum()
    }

    /// The first index, if the ranges are those of a single render without a gap.
    pub fn start(&self) -> Option<u32> {
        match (&self.whole[..], &self.open) {
            ([only], None) => Some(only.start),
            ([only], Some(open)) if only.end == open.start => Some(only.start),
            ([], Some(open)) => Some(open.start),
            _ => None,
        }
    }

    /// Whether pixels may have these minimum and maximum numbers of samples.
    pub(super) fn allows(&self, [least, most]: [u64; 2]) -> bool {
        let open = self.open.as_ref().map_or(0, |range| u64::from(range.end - range.start));
        let whole = self.least();
        (whole..=whole + open).contains(&least) && (whole..=whole + open).contains(&most)
    }

    /// Returns a function from the number of samples made for a pixel to a bit mask of those below
    /// [`LAYER_SAMPLES`] among them. The ranges, of which a file may have any number, are counted
    /// once and not for each pixel.
    pub(super) fn first_samples(&self) -> impl Fn(u64) -> u32 {
        let ranges = self.whole.iter().take_while(|range| range.start < LAYER_SAMPLES);
        let whole = ranges.fold(0, |all, range| all | layer_bits(range));
        let (least, open) = (self.least(), self.open.as_ref());
        move |seen| {
            let begun = u32::try_from(seen.saturating_sub(least)).unwrap_or(u32::MAX);
            let open = open.map(|open| open.start..open.start.saturating_add(begun).min(open.end));
            whole | open.as_ref().map_or(0, layer_bits)
        }
    }

    /// Samples that another film also has, or may have: an open range counts completely.
    pub fn overlap(&self, other: &SampleRanges) -> Option<Range<u32>> {
        let theirs = || other.whole.iter().chain(&other.open);
        let all =
            self.whole.iter().chain(&self.open).flat_map(|mine| theirs().map(|theirs| common(mine, theirs)));
        all.into_iter().find(|both| !both.is_empty())
    }

    /// Two films of a list that have common samples, or may have: their places in the list, and the first of these
    /// samples. An open range counts completely. Takes n·log n steps for n ranges: there may be thousands of films.
    pub fn first_overlap(films: &[&SampleRanges]) -> Option<([usize; 2], Range<u32>)> {
        let of_film = |(i, film): (usize, &&SampleRanges)| {
            film.whole.iter().chain(&film.open).map(|range| (range.start, range.end, i)).collect::<Vec<_>>()
        };
        let mut ranges: Vec<(u32, u32, usize)> = films.iter().enumerate().flat_map(of_film).collect();
        ranges.sort_unstable();
        // Of ranges in ascending order, the first that overlaps any other overlaps the next one.
        ranges.windows(2).find_map(|pair| {
            let [(first, end, i), (next, next_end, j)] = [pair[0], pair[1]];
            let both = common(&(first..end), &(next..next_end));
            (!both.is_empty()).then_some(([i.min(j), i.max(j)], both))
        })
    }

    /// The ranges of films without common samples together, in any order. If several have an open range, only the first
    /// of these remains: see [`SampleRanges::can_join`].
    pub fn of_all<'a>(films: impl IntoIterator<Item = &'a SampleRanges>) -> SampleRanges {
        let (mut whole, mut open) = (Vec::new(), None);
        for film in films {
            whole.extend_from_slice(&film.whole);
            open = open.or_else(|| film.open.clone());
        }
        whole.sort_unstable_by_key(|range: &Range<u32>| range.start);
        whole.dedup_by(|next, range| {
            let touch = range.end == next.start;
            if touch {
                range.end = next.end;
            }
            touch
        });
        SampleRanges { whole, open }
    }

    /// Adds the ranges of another film without common samples, as [`SampleRanges::of_all`] does.
    pub fn join(&mut self, other: &SampleRanges) {
        *self = SampleRanges::of_all([&*self, other]);
    }

    /// Whether one film file can represent both: the count of a pixel determines its part of one open range, not of
    /// two.
    pub fn can_join(&self, other: &SampleRanges) -> bool {
        self.open.is_none() || other.open.is_none()
    }

    /// Missing samples of layers before other samples in the film: nothing is missing from a film that ends before the
    /// last sample of layers.
    pub fn missing_of_layers(&self) -> Vec<Range<u32>> {
        let mut ranges: Vec<&Range<u32>> = self.whole.iter().chain(&self.open).collect();
        ranges.sort_unstable_by_key(|range| range.start);
        let ends = std::iter::once(0).chain(ranges.iter().map(|range| range.end));
        let gaps = ends.zip(&ranges).map(|(end, next)| end..next.start.min(LAYER_SAMPLES));
        gaps.filter(|gap| !gap.is_empty()).collect()
    }

    /// The missing samples between sample 0 and the last whole or open one.
    pub fn missing(&self) -> Vec<Range<u32>> {
        let end = self.whole.iter().chain(&self.open).map(|range| range.end).max().unwrap_or(0);
        let mut missing = Vec::new();
        let mut at = 0;
        for range in &self.whole {
            if at < range.start {
                missing.push(at..range.start);
            }
            at = range.end;
        }
        if at < end {
            missing.push(at..end);
        }
        missing
    }
}

/// A bit for each sample of a range that belongs to layers.
fn layer_bits(range: &Range<u32>) -> u32 {
    let below = |end: u32| (1_u64 << end.min(LAYER_SAMPLES)) - 1;
    (below(range.end) & !below(range.start)) as u32
}

fn common(a: &Range<u32>, b: &Range<u32>) -> Range<u32> {
    a.start.max(b.start)..a.end.min(b.end)
}

/// "0..16, 32..48, and some of 48..64": ranges in the notation of `--range`.
impl fmt::Display for SampleRanges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.whole[..], &self.open) {
            ([], None) => f.write_str("none"),
            ([], Some(open)) => write!(f, "some of {}", Ranges(std::slice::from_ref(open))),
            (whole, None) => write!(f, "{}", Ranges(whole)),
            (whole, Some(open)) => {
                write!(f, "{}, and some of {}", Ranges(whole), Ranges(std::slice::from_ref(open)))
            }
        }
    }
}

/// "0..16, 32..48, 64..": ranges in the notation of `--range`; the last has no end.
pub struct Ranges<'a>(pub &'a [Range<u32>]);

impl fmt::Display for Ranges<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, range) in self.0.iter().enumerate() {
            let comma = if i > 0 { ", " } else { "" };
            write!(f, "{comma}{}..", range.start)?;
            if range.end < u32::MAX {
                write!(f, "{}", range.end)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(first: u32, end: u32) -> SampleRanges {
        SampleRanges::prefix(first..end, u64::from(end - first), u64::from(end - first))
    }

    #[test]
    fn a_prefix_is_whole_up_to_the_least_count() {
        assert_eq!(whole(3, 9), SampleRanges { whole: vec![3..9], open: None });
        let begun = SampleRanges::prefix(3..9, 0, 1);
        assert_eq!((begun.to_string(), begun.least(), begun.start()), ("some of 3..9".into(), 0, Some(3)));
        let ragged = SampleRanges::prefix(3..9, 2, 4);
        assert_eq!(ragged.to_string(), "3..5, and some of 5..9");
        assert_eq!((ragged.least(), ragged.start()), (2, Some(3)));
        assert!(ragged.allows([2, 6]) && !ragged.allows([1, 6]) && !ragged.allows([2, 7]));
        assert_eq!(SampleRanges::prefix(0..4, 0, 0).to_string(), "none");
        assert_eq!(SampleRanges::prefix(3..u32::MAX, 2, 7).to_string(), "3..5, and some of 5..");
    }

    #[test]
    fn adjacent_ranges_join_in_any_order() {
        let parts = [whole(4, 8), whole(0, 4), whole(12, 16), whole(8, 9)];
        for turn in 0..4 {
            let mut all = SampleRanges::default();
            parts.iter().cycle().skip(turn).take(4).for_each(|part| all.join(part));
            assert_eq!((all.to_string(), all.missing()), ("0..9, 12..16".into(), vec![9..12]));
            assert_eq!((all.start(), all.least()), (None, 13));
            all.join(&whole(9, 12));
            assert_eq!((all.start(), all.missing()), (Some(0), vec![]));
        }
    }

    #[test]
    fn overlaps_are_found() {
        let first = whole(0, 10);
        assert_eq!(first.overlap(&whole(9, 12)), Some(9..10));
        assert_eq!(first.overlap(&whole(10, 12)), None);
        // The end of an open range is unknown for a single pixel: all of it counts.
        let mut open = SampleRanges::prefix(10..20, 3, 5);
        assert_eq!(open.overlap(&whole(19, 30)), Some(19..20));
        open.join(&first);
        assert_eq!((open.to_string(), open.missing()), ("0..13, and some of 13..20".into(), vec![13..20]));
        assert!(!open.can_join(&SampleRanges::prefix(40..50, 0, 1)) && open.can_join(&whole(40, 50)));
    }

    #[test]
    fn overlaps_among_many_films_are_found() {
        // Each film has every seventh sample of its own, in descending order.
        let of_film = |i: u32| {
            let every_seventh: Vec<_> = (0..20).map(|k| whole(7 * k + i, 7 * k + i + 1)).collect();
            SampleRanges::of_all(every_seventh.iter().rev())
        };
        let mut films: Vec<SampleRanges> = (0..7).rev().map(of_film).collect();
        let found = |films: &[SampleRanges]| SampleRanges::first_overlap(&films.iter().collect::<Vec<_>>());
        assert_eq!(found(&films), None);
        assert_eq!(SampleRanges::of_all(&films), whole(0, 140));
        films.push(SampleRanges::prefix(139..150, 0, 1));
        // Of the seven films the first one has the last samples.
        assert_eq!(found(&films), Some(([0, 7], 139..140)));
        films.insert(3, whole(20, 30));
        assert_eq!(found(&films), Some(([0, 3], 20..21)));
        assert_eq!(SampleRanges::of_all(&films[4..8]).open(), None);
        assert_eq!(SampleRanges::of_all(&films[4..]).open(), Some(&(139..150)));
        assert_eq!(found(&[]), None);
    }

    #[test]
    fn first_samples_include_whole_ranges_and_the_part_of_the_open_one() {
        let mut sample_ranges = whole(1, 3);
        assert_eq!(sample_ranges.first_samples()(2), 0b110);
        sample_ranges.join(&SampleRanges::prefix(4..40, 0, 9));
        assert_eq!([2, 3, 5].map(|seen| sample_ranges.first_samples()(seen)), [0b110, 0b1_0110, 0b111_0110]);
        assert_eq!(sample_ranges.first_samples()(u64::MAX), u32::MAX << 4 | 0b110);
        assert_eq!(
            (whole(0, 32).first_samples()(32), whole(31, 64).first_samples()(33)),
            (u32::MAX, 1 << 31)
        );
        assert_eq!((whole(32, 64).first_samples()(32), whole(0, 64).first_samples()(64)), (0, u32::MAX));
    }

    #[test]
    fn layers_miss_the_gaps_before_other_samples() {
        let mut sample_ranges = whole(8, 64);
        assert_eq!(sample_ranges.missing_of_layers(), [0..8]);
        sample_ranges.join(&whole(0, 8));
        assert_eq!((sample_ranges.missing_of_layers(), whole(0, 8).missing_of_layers()), (vec![], vec![]));
        assert_eq!(
            (whole(40, 64).missing_of_layers(), SampleRanges::default().missing_of_layers()),
            (vec![0..32], vec![])
        );
        // An open range is not a gap.
        let mut sample_ranges = SampleRanges::prefix(10..500, 2, 5);
        assert_eq!(sample_ranges.missing_of_layers(), [0..10]);
        sample_ranges.join(&whole(2, 6));
        assert_eq!(sample_ranges.missing_of_layers(), [0..2, 6..10]);
        let mut apart = whole(0, 30);
        apart.join(&whole(50, 60));
        apart.join(&whole(70, 80));
        assert_eq!(apart.missing_of_layers(), [30..32]);
    }

    #[test]
    fn ranges_of_a_file_must_be_in_order() {
        assert_eq!(SampleRanges::new(vec![0..2, 4..5], Some(2..4)).unwrap().start(), None);
        assert!(SampleRanges::new(vec![], None).is_some());
        for (whole, open) in [
            (vec![2..3, 0..1], None),
            (vec![0..1, 1..2], None),
            (vec![1..1], None),
            (vec![0..4], Some(3..5)),
            (vec![], Some(7..7)),
        ] {
            assert_eq!(SampleRanges::new(whole.clone(), open.clone()), None, "{whole:?} {open:?}");
        }
    }
}
