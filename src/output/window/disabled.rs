//! No window: the feature `window` was left out.

use std::convert::Infallible;

use crossbeam_channel::Sender;

use super::{Feed, Left, Request, WindowError, WindowOptions};

/// A window; there is none in this build.
#[derive(Debug)]
pub struct Window(Infallible);

/// Says that this build has no window.
pub fn open(_options: &WindowOptions) -> Result<Window, WindowError> {
    Err(WindowError::NotBuilt)
}

impl Window {
    /// Cannot be called, as there is no window.
    pub fn run(&mut self, _feed: &Feed, _requests: &Sender<Request>, _away: bool) -> Left {
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
