//! Processes that are waited for.

use super::error::SessionError;
use std::thread::{Scope, ScopedJoinHandle};

/// A process of a render, and what it is called where it fails.
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

    /// Waits for its end. A panic is an error.
    pub(super) fn join(self) -> Result<T, SessionError> {
        self.thread.join().map_err(|_| SessionError::Process(self.name))
    }
}
