//! No window: the feature `window` was left out.

use std::convert::Infallible;
use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender};

use super::{Closed, Request, WindowError, WindowOptions};
use crate::film::Snapshot;

/// A window; there is none in this build.
#[derive(Debug)]
pub struct Window(Infallible);

/// Says that this build has no window.
pub fn open(_options: &WindowOptions) -> Result<Window, WindowError> {
    Err(WindowError::NotBuilt)
}

impl Window {
    /// Cannot be called, as there is no window.
    pub fn run(
        self,
        _snapshots: Receiver<Arc<Snapshot>>,
        _requests: Sender<Request>,
        _stop: Receiver<Infallible>,
    ) -> Closed {
        match self.0 {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_that_it_was_left_out() {
        let options = WindowOptions {
            name: "a".into(),
            width: 1,
            height: 1,
            exposure: 0.0,
            overlay: false,
            time_limit: None,
        };
        let error = open(&options).unwrap_err();
        assert!(error.to_string().contains("--features window"), "{error}");
    }
}
