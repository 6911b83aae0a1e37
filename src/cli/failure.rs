//! Failures of a command.

use crate::api::{Error, SettingsError};
use crate::output::OutputError;
use crate::scene::SceneErrors;
use crate::session::SessionError;

/// The reason why a command fails.
#[derive(Debug)]
pub(super) enum Failure {
    /// The command line is invalid: exit code 2.
    Usage(anyhow::Error),
    /// The command failed during its execution: exit code 1.
    Failed(anyhow::Error),
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Failure {
        let error = error.into();
        // A file name without a known format is an error of the command line, whatever the command and the option.
        let output = match error.downcast_ref() {
            Some(Error::Session(SessionError::Output(output))) => Some(output),
            _ => error.downcast_ref(),
        };
        let is_usage = matches!(output, Some(OutputError::UnknownFormat { .. }))
            || matches!(error.downcast_ref(), Some(Error::Settings(_)))
            || error.is::<SettingsError>();
        if is_usage { Failure::Usage(error) } else { Failure::Failed(error) }
    }
}

/// An error of the command line itself.
pub(super) fn usage(message: impl std::fmt::Display) -> Failure {
    Failure::Usage(anyhow::anyhow!("{message}"))
}

/// Settings as named in messages of the library, and the corresponding options.
const OPTIONS: [(&str, &str); 18] = [
    ("checkpoint", "--checkpoint"),
    ("crop", "--crop"),
    ("device", "--device"),
    ("dump_at", "--dump-at"),
    ("film", "--film"),
    ("film_mode", "--film-mode"),
    ("layers", "--layers"),
    ("noise", "--noise"),
    ("output", "-o"),
    ("overlay", "--overlay"),
    ("range", "--range"),
    ("sample_file", "--samples"),
    ("samples", "--spp"),
    ("size", "--size"),
    ("tev", "--tev"),
    ("threads", "--threads"),
    ("time", "--time"),
    ("view", "--headless"),
];

/// Replaces settings in backquotes in a message of the library by the options of the command line.
pub(super) fn with_options(message: &str) -> String {
    let option = |text: String, (setting, option)| text.replace(&format!("`{setting}`"), option);
    OPTIONS.into_iter().fold(message.to_owned(), option)
}

impl Failure {
    /// The message for the user.
    pub(super) fn message(&self) -> String {
        let (Failure::Usage(error) | Failure::Failed(error)) = self;
        let message = format!("{error:#}");
        // A quotation from a scene file is not a setting.
        if error.is::<SceneErrors>() { message } else { with_options(&message) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_have_the_names_of_options() {
        let failure = Failure::from(SettingsError::BeforeFilm { samples: 8, first: 16 });
        assert!(matches!(failure, Failure::Usage(_)));
        assert!(failure.message().starts_with("--spp 8 requests the samples 0 to 7"), "{failure:?}");
        assert_eq!(with_options("a `word` that is no `film_mode`"), "a `word` that is no --film-mode");
    }
}
