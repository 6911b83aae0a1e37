//! Sends the picture to the viewer [tev](https://github.com/Tom94/tev) as it refines.
//!
//! A picture travels in bands of rows, so that no packet is large however large the picture. Whoever does not
//! answer is given up: a render never waits for a viewer longer than [`PATIENCE`].

use crate::film::{Picture, Snapshot};
use crossbeam_channel::Receiver;
use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};
use thiserror::Error;

/// How long tev may take to answer, or to take in what it is sent.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// Pixels in a band: 3 MiB.
const BAND: u32 = 1 << 18;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// There is no tev where it was looked for.
#[derive(Debug, Error)]
#[error("tev does not answer at {address} ({error}); start it first, or leave --tev away")]
pub struct TevError {
    /// Where.
    address: String,
    /// What happened instead.
    #[source]
    error: io::Error,
}

/// A tev that shows a picture of ours.
#[derive(Debug)]
pub struct Tev {
    client: TevClient,
    address: String,
    name: String,
}

impl Tev {
    /// Opens a black picture of this name and size in the tev that listens at `address`, a host and a port.
    pub fn connect(address: &str, name: &str, width: u32, height: u32) -> Result<Tev, TevError> {
        let fail = |error| TevError { address: address.to_owned(), error };
        let socket = connect(address).map_err(fail)?;
        // A name ends at a NUL.
        let (address, name) = (address.to_owned(), name.replace('\0', ""));
        let mut client = TevClient::wrap(socket);
        let image_name = &name;
        let create =
            PacketCreateImage { image_name, grab_focus: true, width, height, channel_names: &CHANNELS };
        client.send(create).map_err(fail)?;
        Ok(Tev { client, address, name })
    }

    /// Shows pictures until their channel closes, or tev does: then `say` hears of it, and there is none any more.
    pub fn show(mut self, snapshots: &Receiver<Arc<Snapshot>>, say: impl FnOnce(String)) -> Option<Tev> {
        for snapshot in snapshots {
            if let Err(error) = self.send(&snapshot.picture) {
                let address = &self.address;
                say(format!("warning: tev at {address} is gone ({error}); the render goes on without it"));
                return None;
            }
        }
        Some(self)
    }

    fn send(&mut self, picture: &Picture) -> io::Result<()> {
        let (width, rows) = (picture.width, (BAND / picture.width.max(1)).max(1));
        for (band, y) in picture.rgb.chunks((rows * width) as usize).zip((0..).step_by(rows as usize)) {
            self.client.send(PacketUpdateImage {
                image_name: &self.name,
                grab_focus: false,
                channel_names: &CHANNELS,
                channel_offsets: &[0, 1, 2],
                channel_strides: &[3; 3],
                x: 0,
                y,
                width,
                height: band.len() as u32 / width,
                data: band.as_flattened(),
            })?;
        }
        Ok(())
    }
}

/// The first of a host's addresses that answers.
fn connect(address: &str) -> io::Result<TcpStream> {
    let mut last = None;
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(socket) => {
                socket.set_write_timeout(Some(PATIENCE))?;
                return Ok(socket);
            }
            Err(error) => last = Some(error),
        }
    }
    Err(last.unwrap_or_else(|| io::Error::new(io::ErrorKind::NotFound, "the host has no address")))
}
