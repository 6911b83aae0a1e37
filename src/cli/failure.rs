//! Failures of a command.

use crate::api::{Error, SettingsError};
use crate::output::OutputError;
use crate::scene::SceneErrors;
use crate::session::SessionError;

/// Why a command ends without success.
#[derive(Debug)]
pub(super) enum Failure {
    /// The command line asks for something that can't be: exit code 2.
    Usage(anyhow::Error),
    /// It went wrong on the way: exit code 1.
    Failed(anyhow::Error),
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Failure {
        let error = error.into();
        // A name that tells no format is the command line's fault, whatever the command and the option.
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

/// A failure of the command line itself.
pub(super) fn usage(message: impl std::fmt::Display) -> Failure {
    Failure::Usage(anyhow::anyhow!("{message}"))
}

/// Settings as messages of the library name them, and their options.
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

/// A message of the library, whose settings stand in backquotes, with the options of the command line instead.
pub(super) fn with_options(message: &str) -> String {
    let option = |text: String, (setting, option)| text.replace(&format!("`{setting}`"), option);
    OPTIONS.into_iter().fold(message.to_owned(), option)
}

impl Failure {
    /// What to tell the user.
    pub(super) fn message(&self) -> String {
        let (Failure::Usage(error) | Failure::Failed(error)) = self;
        let message = format!("{error:#}");
        // What a scene file quotes is not a setting.
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
        assert!(failure.message().starts_with("--spp 8 asks for the samples 0 to 7"), "{failure:?}");
        assert_eq!(with_options("a `word` that is no `film_mode`"), "a `word` that is no --film-mode");
    }
}
