//! Errors, warnings, and reports of parts without a counterpart, with their places in several files.

use crate::scene::diagnostic::{Cursor, Diagnostic, SceneErrors};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The maximum number of errors that are described.
const MOST_ERRORS: usize = 100;

/// The maximum number of notes on meshes that are described. A scene may have one for each of a thousand files.
const MOST_NOTES: usize = 10;

/// The message about a file whose error has been reported.
pub(super) const UNREADABLE: &str = "this file cannot be read, as reported at its first place";

/// The maximum number of features without a counterpart that are described.
const MOST_LACKS: usize = 50;

/// A byte offset in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    /// The index of the file, in the order of reading.
    pub(super) file: usize,
    pub(super) at: usize,
}

/// Proof that an error has been reported. Only [`Reports`] creates it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reported(());

/// A converted part, or proof that an error was reported.
pub(super) type Read<T> = Result<T, Reported>;

/// A message about a place.
struct Report {
    place: Place,
    message: String,
    help: Option<String>,
}

/// A kind of part without a counterpart, its first place, and the number of its occurrences.
struct Lack {
    first: Report,
    count: usize,
}

/// All messages about the files of a scene so far.
#[derive(Default)]
pub(super) struct Reports {
    files: Vec<(PathBuf, Arc<str>)>,
    /// The index of the file that includes each file.
    includers: HashMap<usize, usize>,
    errors: Vec<Report>,
    unlisted: usize,
    warnings: Vec<Report>,
    unlisted_warnings: usize,
    notes: usize,
    lacks: Vec<Lack>,
    lack_of: HashMap<String, usize>,
}

impl Reports {
    /// Adds a file, and returns its index.
    pub(super) fn add_file(&mut self, path: &Path, text: Arc<str>) -> usize {
        self.files.push((path.into(), text));
        self.files.len() - 1
    }

    /// The path of a file.
    pub(super) fn path(&self, file: usize) -> &Path {
        &self.files[file].0
    }

    /// Notes that a file is included by another.
    pub(super) fn included_by(&mut self, file: usize, by: usize) {
        self.includers.insert(file, by);
    }

    /// The file that includes another.
    pub(super) fn includer(&self, file: usize) -> Option<usize> {
        self.includers.get(&file).copied()
    }

    pub(super) fn error(&mut self, place: Place, message: impl Into<String>) -> Reported {
        self.error_with(place, message, || None)
    }

    /// Reports an error. Its help is computed only if it is shown, because a file may have a million errors.
    pub(super) fn error_with(
        &mut self,
        place: Place,
        message: impl Into<String>,
        help: impl FnOnce() -> Option<String>,
    ) -> Reported {
        if self.errors.len() < MOST_ERRORS {
            self.errors.push(Report { place, message: message.into(), help: help() });
        } else {
            self.unlisted += 1;
        }
        Reported(())
    }

    pub(super) fn warn(&mut self, place: Place, message: impl Into<String>, help: Option<String>) {
        if self.warnings.len() < MOST_ERRORS {
            self.warnings.push(Report { place, message: message.into(), help });
        } else {
            self.unlisted_warnings += 1;
        }
    }

    /// Adds a warning about a mesh. Only the first of them are described.
    pub(super) fn note(&mut self, place: Place, message: impl Into<String>, help: Option<String>) {
        self.notes += 1;
        if self.notes <= MOST_NOTES {
            self.warn(place, message, help);
        }
    }

    /// Reports a part without a counterpart, and its replacement.
    pub(super) fn lacks(&mut self, place: Place, what: impl Into<String>, instead: &str) {
        let what = what.into();
        if let Some(&known) = self.lack_of.get(&what) {
            self.lacks[known].count += 1;
            return;
        }
        self.lack_of.insert(what.clone(), self.lacks.len());
        let first = Report { place, message: what, help: Some(instead.to_owned()) };
        self.lacks.push(Lack { first, count: 1 });
    }

    /// The warnings, in the order of the files, or the errors. With `strict`, features without a counterpart are
    /// errors. Only the first of them are described.
    pub(super) fn finish(self, strict: bool) -> Result<Vec<Diagnostic>, SceneErrors> {
        let Reports {
            files, mut errors, unlisted, mut warnings, unlisted_warnings, notes, mut lacks, ..
        } = self;
        lacks.sort_by_key(|lack| lack.first.place);
        let more = lacks.len().saturating_sub(MOST_LACKS);
        let told = lacks.into_iter().take(MOST_LACKS).map(|Lack { first, count }| {
            let all =
                if count > 1 { format!(" ({count} in all, the first one here)") } else { String::new() };
            let help = first.help.map(|help| if strict { format!("without --strict, {help}") } else { help });
            Report { message: format!("{} has no counterpart{all}", first.message), help, ..first }
        });
        if strict {
            errors.extend(told);
        } else {
            warnings.extend(told);
        }
        if !errors.is_empty() {
            return Err(SceneErrors::new(located(&files, errors), unlisted + if strict { more } else { 0 }));
        }
        let mut told = located(&files, warnings);
        let file: Arc<Path> = files.first().map_or(Path::new(""), |(path, _)| path).into();
        let mut tell = |count: usize, what: &str| {
            if count > 0 {
                let message = format!("and {count} more {what}");
                told.push(Diagnostic { file: Arc::clone(&file), position: None, message, help: None });
            }
        };
        tell(unlisted_warnings, "warnings");
        tell(notes.saturating_sub(MOST_NOTES), "warnings about meshes");
        tell(more, "features without a counterpart");
        Ok(told)
    }
}

/// Sorts reports by place.
fn located(files: &[(PathBuf, Arc<str>)], mut reports: Vec<Report>) -> Vec<Diagnostic> {
    reports.sort_by_key(|report| report.place);
    let mut all = Vec::with_capacity(reports.len());
    for of_file in reports.chunk_by(|a, b| a.place.file == b.place.file) {
        let Some((path, text)) = files.get(of_file[0].place.file) else { continue };
        let (file, mut cursor): (Arc<Path>, _) = (path.as_path().into(), Cursor::new(text));
        all.extend(of_file.iter().map(|report| Diagnostic {
            file: Arc::clone(&file),
            position: Some(cursor.advance(report.place.at)),
            message: report.message.clone(),
            help: report.help.clone(),
        }));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(at: usize) -> Place {
        Place { file: 0, at }
    }

    fn reports() -> Reports {
        let mut reports = Reports::default();
        reports.add_file(Path::new("a.xml"), "x".repeat(1000).into());
        reports
    }

    #[test]
    fn help_is_looked_for_only_where_it_is_shown() {
        let (mut reports, mut asked) = (reports(), 0);
        for i in 0..1000 {
            reports.error_with(at(i), "wrong", || {
                asked += 1;
                None
            });
        }
        assert_eq!(asked, MOST_ERRORS);
        let errors = reports.finish(false).expect_err("errors");
        assert_eq!((errors.diagnostics().len(), errors.unlisted()), (MOST_ERRORS, 1000 - MOST_ERRORS));
    }

    #[test]
    fn features_and_warnings_beyond_some_are_counted() {
        let made = |features: usize, warnings: usize| {
            let mut reports = reports();
            // The last one of the file is found first.
            for i in (0..features).rev() {
                reports.lacks(at(i), format!("feature {i}"), "nothing");
                reports.lacks(at(i), format!("feature {i}"), "nothing");
            }
            (0..warnings).for_each(|i| reports.warn(at(i), "odd", None));
            reports
        };
        let told = made(MOST_LACKS, MOST_ERRORS).finish(false).expect("no errors");
        assert_eq!(told.len(), MOST_LACKS + MOST_ERRORS);
        let told = made(MOST_LACKS + 7, 0).finish(false).expect("no errors");
        let first = "a.xml:1:1: feature 0 has no counterpart (2 in all, the first one here); nothing";
        assert_eq!(told[0].to_string(), first);
        assert_eq!(told.len(), MOST_LACKS + 1);
        assert_eq!(told[MOST_LACKS].to_string(), "a.xml: and 7 more features without a counterpart");
        let mut reports = reports();
        (0..MOST_NOTES + 5).for_each(|i| reports.note(at(i), "flat", None));
        let told = reports.finish(false).expect("no errors");
        assert_eq!(told.len(), MOST_NOTES + 1);
        assert_eq!(told[MOST_NOTES].to_string(), "a.xml: and 5 more warnings about meshes");
        let told = made(0, MOST_ERRORS + 3).finish(false).expect("no errors");
        assert_eq!(told[MOST_ERRORS].to_string(), "a.xml: and 3 more warnings");
        let errors = made(MOST_LACKS + 7, 0).finish(true).expect_err("strict");
        assert_eq!((errors.diagnostics().len(), errors.unlisted()), (MOST_LACKS, 7));
    }
}
