//! The nearest spelling of a name, and words of a file made safe to print.

use super::synonyms::WORDS;
use std::fs;
use std::path::Path;

/// The maximum length in bytes of words for which suggestions are made.
const MAX_WORD: usize = 64;

/// A word of the file in quotes, shortened and made safe to print.
pub(super) fn quote(word: &str) -> String {
    format!("\"{}\"", shorten(word))
}

/// The first line of some text of the file, without terminal control sequences.
pub(super) fn shorten(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut short = String::new();
    for (length, c) in text.chars().enumerate() {
        if length == LONGEST || c == '\n' || c == '\r' {
            short.push('…');
            break;
        }
        // Printable letters of any language stay; control characters and the like are escaped.
        if c.is_control() || c.escape_debug().next() == Some('\\') && !matches!(c, '"' | '\'' | '\\') {
            short.extend(c.escape_default());
        } else {
            short.push(c);
        }
    }
    short
}

/// The candidate that `word` most likely misspells.
pub(super) fn nearest<'c>(word: &str, candidates: impl Iterator<Item = &'c str> + Clone) -> Option<&'c str> {
    if word.is_empty() || word.len() > MAX_WORD {
        return None;
    }
    let lower = word.to_lowercase();
    let candidates = candidates.filter(|candidate| candidate.len() <= MAX_WORD).take(1000);
    let spelling = candidates
        .clone()
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, candidate)| 3 * distance <= word.chars().count().max(candidate.chars().count()))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate);
    spelling
        .or_else(|| {
            let synonyms = WORDS.iter().filter(|(theirs, _)| *theirs == lower);
            synonyms.filter_map(|(_, ours)| candidates.clone().find(|candidate| candidate == ours)).next()
        })
        .or_else(|| {
            // Half of a compound name: "fov" for "vertical_fov".
            candidates
                .clone()
                .find(|candidate| candidate.contains('_') && candidate.split('_').any(|p| p == lower))
        })
}

/// The names of up to 1000 files in the folder of `path` that `is_candidate` accepts: the folder may contain millions,
/// and a suggestion is not worth reading all of them.
pub(super) fn files_beside(path: &Path, is_candidate: impl Fn(&str) -> bool) -> Vec<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let names = entries.take(1000).filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    names.filter(|name| is_candidate(name)).collect()
}

/// The file beside `path`, which does not exist, with the most similar name.
pub(super) fn file_beside(path: &Path, is_candidate: impl Fn(&str) -> bool) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let beside = files_beside(path, is_candidate);
    nearest(name, beside.iter().map(String::as_str)).map(str::to_owned)
}

/// The message about an unknown word for `what`.
pub(super) fn unknown(what: &str, word: &str) -> String {
    format!("unknown {what} {}", quote(word))
}

/// The suggestion for `word`: the nearest candidate, or all of them.
pub(super) fn instead<'c>(word: &str, candidates: impl Iterator<Item = &'c str> + Clone) -> Option<String> {
    match nearest(word, candidates.clone()) {
        Some(nearest) => Some(format!("did you mean {}?", quote(nearest))),
        None => list(candidates).map(|all| format!("valid here: {all}")),
    }
}

/// Words in quotes, separated by commas, at most a dozen.
pub(super) fn list<'c>(words: impl Iterator<Item = &'c str> + Clone) -> Option<String> {
    const MOST: usize = 12;
    let mut text = words.clone().take(MOST).map(quote).collect::<Vec<_>>().join(", ");
    if words.clone().nth(MOST).is_some() {
        text.push_str(", …");
    }
    (!text.is_empty()).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [&str; 5] = ["eye", "vertical_fov", "aperture_radius", "reflectance", "samples"];

    fn near(word: &str) -> Option<&'static str> {
        nearest(word, KEYS.into_iter())
    }

    #[test]
    fn misspellings_are_found_in_any_case() {
        assert_eq!(near("ey"), Some("eye"));
        assert_eq!(near("yee"), Some("eye"));
        assert_eq!(near("Aperture-Radius"), Some("aperture_radius"));
        assert_eq!(near("sampels"), Some("samples"));
    }

    #[test]
    fn words_of_other_programs_and_halves_of_compounds_are_known() {
        assert_eq!(near("albedo"), Some("reflectance"));
        assert_eq!(near("spp"), Some("samples"));
        assert_eq!(near("fov"), Some("vertical_fov"));
        assert_eq!(near("radius"), Some("aperture_radius"));
    }

    #[test]
    fn unrelated_words_have_no_suggestion() {
        for word in ["", "x", "width", "integrator", &"s".repeat(1 << 20)] {
            assert_eq!(near(word), None);
        }
    }

    #[test]
    fn quoted_text_is_short_and_free_of_control_sequences() {
        assert_eq!(quote("größe \"a\""), "\"größe \"a\"\"");
        assert_eq!(quote("\u{1b}[2J\u{202e}\u{200b}"), "\"\\u{1b}[2J\\u{202e}\\u{200b}\"");
        assert_eq!(quote("one\ntwo"), "\"one…\"");
        assert_eq!(quote(&"é".repeat(99)).chars().count(), 43);
    }
}
