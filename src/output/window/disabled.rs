//! No window: built without the feature `window`.

use std::convert::Infallible;

use crossbeam_channel::Sender;

use super::{ExitReason, Feed, Request, WindowError, WindowOptions};

/// A window, which does not exist in this build.
#[derive(Debug)]
pub struct Window(Infallible);

/// Fails, because this build has no window.
pub fn open(_options: &WindowOptions) -> Result<Window, WindowError> {
    Err(WindowError::NotBuilt)
}

impl Window {
    /// Cannot be called, because there is no window.
    pub fn run(&mut self, _feed: &Feed, _requests: &Sender<Request>, _away: bool) -> ExitReason {
        match self.0 {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_names_the_feature() {
        let options = WindowOptions {
            name: "a".into(),
            width: 1,
            height: 1,
            film_height: 1,
            corner: (0, 0),
            view: crate::film::ViewTransform::default(),
            overlay: false,
            time_limit: None,
            camera: Err(String::new()),
        };
        let error = open(&options).unwrap_err();
        assert!(error.to_string().contains("--features window"), "{error}");
    }
}
