//! Named processes that are joined.

use super::error::SessionError;
use std::thread::{Scope, ScopedJoinHandle};

/// A process of a render, with its name for error messages.
pub(super) struct Process<'scope, T> {
    name: &'static str,
    thread: ScopedJoinHandle<'scope, T>,
}

impl<'scope, T: Send + 'scope> Process<'scope, T> {
    pub(super) fn start(
        scope: &'scope Scope<'scope, '_>,
        name: &'static str,
        work: impl FnOnce() -> T + Send + 'scope,
    ) -> Process<'scope, T> {
        Process { name, thread: scope.spawn(work) }
    }

    /// Waits for its end. A panic becomes an error.
    pub(super) fn join(self) -> Result<T, SessionError> {
        self.thread.join().map_err(|_| SessionError::Process(self.name))
    }
}
