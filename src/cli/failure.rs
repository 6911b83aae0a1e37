//! Failures of a command.

use crate::output::OutputError;

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
        match error.downcast_ref() {
            Some(OutputError::UnknownFormat { .. }) => Failure::Usage(error),
            _ => Failure::Failed(error),
        }
    }
}

/// A failure of the command line itself.
pub(super) fn usage(message: impl std::fmt::Display) -> Failure {
    Failure::Usage(anyhow::anyhow!("{message}"))
}
