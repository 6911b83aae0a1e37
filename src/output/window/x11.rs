//! Checks with the X server, before minifb does, whether a window can be opened.
//!
//! minifb reports a display that it cannot use, but then frees the display's own graphics context twice and the
//! program crashes (observed with 0.29: 16-bit screens, and an input method that is set but not running).
//! This module detects these cases over a separate connection in safe code.

use x11rb::connection::Connection;
use x11rb::errors::{ConnectionError, ReplyError};
use x11rb::protocol::xproto::{AtomEnum, ConnectionExt, Screen};
use x11rb::rust_connection::RustConnection;

use super::WindowError;

/// The pixel format of minifb.
const BITS_PER_PIXEL: u8 = 32;
/// The maximum fraction of the screen for an initial window: frames and panels need some space too.
const PART_OF_SCREEN: f64 = 0.85;

/// An X server on which a window can be opened.
pub(super) struct Display {
    /// The maximum initial size of a window in pixels.
    pub(super) largest: (u32, u32),
    /// Kept until the window is open: some servers restart when their last client disconnects, and reject
    /// connections meanwhile.
    _connection: RustConnection,
}

/// The display on which a window would open, or the reason why it cannot.
pub(super) fn find() -> Result<Display, WindowError> {
    let display = std::env::var("DISPLAY").unwrap_or_default();
    if display.is_empty() {
        return Err(WindowError::NoDisplay);
    }
    let (connection, screen) = x11rb::connect(None).map_err(|error| {
        WindowError::Failed(format!("no X server answers at DISPLAY={display} ({error})"))
    })?;
    let setup = connection.setup();
    let screen = &setup.roots[screen];
    let format = setup.pixmap_formats.iter().find(|format| format.depth == screen.root_depth);
    if format.is_none_or(|format| format.bits_per_pixel != BITS_PER_PIXEL) {
        let depth = screen.root_depth;
        return Err(WindowError::Failed(format!(
            "the screen has {depth} bits per pixel, and 24 are required"
        )));
    }
    let modifiers = std::env::var("XMODIFIERS").unwrap_or_default();
    if let Some(name) = input_method(&modifiers)
        && !is_running(&connection, screen, name).unwrap_or(false)
    {
        return Err(WindowError::Failed(format!(
            "the input method {name:?} of XMODIFIERS is not running (start it, or set XMODIFIERS=@im=none)"
        )));
    }
    let part = |length: u16| (f64::from(length) * PART_OF_SCREEN) as u32;
    let largest = (part(screen.width_in_pixels).max(1), part(screen.height_in_pixels).max(1));
    Ok(Display { largest, _connection: connection })
}

/// The input method server that Xlib will use: `@im=NAME`, unless it is one that is built into Xlib.
fn input_method(modifiers: &str) -> Option<&str> {
    // Xlib ignores modifiers that do not begin with an @.
    let name = modifiers.split('@').skip(1).find_map(|modifier| modifier.strip_prefix("im="))?;
    (!["", "none", "local"].contains(&name)).then_some(name)
}

/// Checks as Xlib does: the root window lists the servers, and a running one owns its name.
fn is_running(connection: &RustConnection, screen: &Screen, name: &str) -> Result<bool, ReplyError> {
    let atom = |name: &str| Ok::<_, ReplyError>(connection.intern_atom(true, name.as_bytes())?.reply()?.atom);
    let (servers, server) = (atom("XIM_SERVERS")?, atom(&format!("@server={name}"))?);
    if servers == x11rb::NONE || server == x11rb::NONE {
        return Ok(false);
    }
    let listed = connection.get_property(false, screen.root, servers, AtomEnum::ATOM, 0, 1000)?.reply()?;
    let listed = listed.value32().ok_or(ConnectionError::UnknownError)?.any(|atom| atom == server);
    Ok(listed && connection.get_selection_owner(server)?.reply()?.owner != x11rb::NONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn input_methods_are_found_in_modifiers() {
        for (modifiers, name) in [
            ("", None),
            ("@im=", None),
            ("@im=none", None),
            ("@im=local", None),
            ("@im=ibus", Some("ibus")),
            ("@foo=bar@im=fcitx", Some("fcitx")),
            ("@im=fcitx@foo=bar", Some("fcitx")),
            ("im=ibus", None),
        ] {
            assert_eq!(input_method(modifiers), name, "{modifiers}");
        }
    }
}
