//! Sends the picture to the viewer [tev](https://github.com/Tom94/tev) during the render.
//!
//! A picture is sent in bands of rows, which limits the size of packets. Only the end of the program waits for the
//! viewer, and a viewer that receives nothing or too slowly is disconnected: see `Timeouts`.

use crate::film::{Picture, Snapshot};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use std::io::{self, ErrorKind};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};
use thiserror::Error;

/// Time limits for tev.
#[derive(Clone, Copy, Debug)]
struct Timeouts {
    /// Until it answers, or receives more data.
    standstill: Duration,
    /// Until it has received a picture, at any rate.
    picture: Duration,
}

const TIMEOUTS: Timeouts = Timeouts { standstill: Duration::from_secs(5), picture: Duration::from_secs(20) };

/// The maximum number of snapshots in the channel: one being sent, and the last.
pub const MOST_WAITING: usize = 2;

/// Pixels in a band: 3 MiB.
const BAND: u32 = 1 << 18;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// tev cannot be reached at an address.
#[derive(Debug, Error)]
#[error("tev does not answer at {address} ({error}); start it first, or omit `tev`")]
pub struct TevError {
    /// The address.
    address: String,
    /// The error of the connection.
    #[source]
    error: io::Error,
}

/// A connection to tev, with a picture.
#[derive(Debug)]
pub struct Tev {
    client: TevClient,
    /// The same connection, for closing it.
    guard: TcpStream,
    address: String,
    name: String,
    timeouts: Timeouts,
}

impl Tev {
    /// Opens a black picture of this name and size in the tev that listens at `address`, a host and a port.
    pub fn connect(address: &str, name: &str, width: u32, height: u32) -> Result<Tev, TevError> {
        Tev::with_timeouts(address, name, [width, height], TIMEOUTS)
    }

    fn with_timeouts(
        address: &str,
        name: &str,
        [width, height]: [u32; 2],
        timeouts: Timeouts,
    ) -> Result<Tev, TevError> {
        let fail = |error| TevError { address: address.to_owned(), error };
        let socket = connect(address, timeouts.standstill).map_err(fail)?;
        // A name ends at a NUL.
        let (address, name) = (address.to_owned(), name.replace('\0', ""));
        let guard = socket.try_clone().map_err(fail)?;
        let mut client = TevClient::wrap(socket);
        let image_name = &name;
        let create =
            PacketCreateImage { image_name, grab_focus: true, width, height, channel_names: &CHANNELS };
        client.send(create).map_err(fail)?;
        Ok(Tev { client, guard, address, name, timeouts })
    }

    /// Shows pictures until their channel closes, or the connection is lost, which is reported by `say` and returns
    /// `None`. Of several waiting pictures only the latest is sent.
    pub fn show(mut self, snapshots: &Receiver<Arc<Snapshot>>, say: impl FnOnce(String)) -> Option<Tev> {
        let shown = std::thread::scope(|scope| {
            let (turns_out, turns) = bounded(0);
            // A slow write does not time out as long as it makes progress: another thread has to end it.
            let (guard, within) = (&self.guard, self.timeouts.picture);
            scope.spawn(move || end_late(guard, within, &turns));
            for snapshot in snapshots {
                let latest = snapshots.try_iter().last().unwrap_or(snapshot);
                send(&mut self.client, &self.name, &latest.picture, &turns_out, self.timeouts)?;
            }
            Ok(())
        });
        let Err(error): io::Result<()> = shown else { return Some(self) };
        let address = &self.address;
        say(format!(
            "warning: the connection to tev at {address} was lost ({error}); the render continues without it"
        ));
        None
    }
}

/// Sends a picture, and signals over `turns` when it starts and when it is sent.
fn send(
    client: &mut TevClient,
    name: &str,
    picture: &Picture,
    turns: &Sender<()>,
    timeouts: Timeouts,
) -> io::Result<()> {
    let (start, seconds) = (Instant::now(), |time: Duration| time.as_secs_f64());
    // The watchdog is gone only after the end.
    let _ = turns.send(());
    let sent = send_bands(client, name, picture).map_err(|error| match error.kind() {
        _ if start.elapsed() >= timeouts.picture => {
            let late = format!("it needs more than {} s for a picture", seconds(timeouts.picture));
            io::Error::new(ErrorKind::TimedOut, late)
        }
        ErrorKind::WouldBlock | ErrorKind::TimedOut => {
            let still = format!("it has received nothing for {} s", seconds(timeouts.standstill));
            io::Error::new(ErrorKind::TimedOut, still)
        }
        _ => error,
    });
    let _ = turns.send(());
    sent
}

fn send_bands(client: &mut TevClient, image_name: &str, picture: &Picture) -> io::Result<()> {
    let (width, rows) = (picture.width, (BAND / picture.width.max(1)).max(1));
    for (band, y) in picture.rgb.chunks((rows * width) as usize).zip((0..).step_by(rows as usize)) {
        client.send(PacketUpdateImage {
            image_name,
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

/// Closes a connection if a picture takes longer than `within`; `turns` signals when one starts and when it is sent.
fn end_late(socket: &TcpStream, within: Duration, turns: &Receiver<()>) {
    while turns.recv().is_ok() {
        if turns.recv_timeout(within) == Err(RecvTimeoutError::Timeout) {
            // The connection may have been closed already.
            let _ = socket.shutdown(Shutdown::Both);
            return;
        }
    }
}

/// Connects to the first address of a host that answers.
fn connect(address: &str, timeouts: Duration) -> io::Result<TcpStream> {
    let mut last = None;
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, timeouts) {
            Ok(socket) => {
                socket.set_write_timeout(Some(timeouts))?;
                return Ok(socket);
            }
            Err(error) => last = Some(error),
        }
    }
    Err(last.unwrap_or_else(|| io::Error::new(io::ErrorKind::NotFound, "the host has no address")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Statistics;
    use std::io::Read;
    use std::net::TcpListener;

    fn snapshot(width: u32, height: u32) -> Arc<Snapshot> {
        let rgb = vec![[0.5; 3]; (width * height) as usize];
        Arc::new(Snapshot {
            picture: Picture { width, height, rgb },
            statistics: Arc::new(Statistics::default()),
            owners: Arc::default(),
            spp_done: 1.0,
            spp_before: 0.0,
            spp_target: None,
            noise: None,
            samples: 1,
            seconds: 1.0,
            finished: false,
        })
    }

    /// The message about a tev that receives `piece` bytes at a time, with a pause after each.
    fn said(piece: usize, rest: Duration, timeouts: Timeouts) -> Option<String> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let (over_out, over) = bounded::<()>(0);
        let mut told = None;
        std::thread::scope(|scope| {
            scope.spawn(move || {
                let (mut socket, _) = listener.accept().unwrap();
                let mut bytes = vec![0; piece];
                while over.recv_timeout(rest) == Err(RecvTimeoutError::Timeout) {
                    if piece > 0 && socket.read(&mut bytes).is_ok_and(|count| count == 0) {
                        return;
                    }
                }
            });
            // 24 MiB: more than the buffers of sockets.
            let tev = Tev::with_timeouts(&address, "name", [2048, 1024], timeouts).unwrap();
            let (sender, snapshots) = bounded(MOST_WAITING);
            sender.send(snapshot(2048, 1024)).unwrap();
            sender.send(snapshot(2048, 1024)).unwrap();
            drop(sender);
            let is_there = tev.show(&snapshots, |line| told = Some(line)).is_some();
            assert_eq!(is_there, told.is_none());
            drop(over_out);
        });
        told
    }

    #[test]
    fn a_viewer_that_stalls_or_is_too_slow_is_disconnected() {
        let (short, long) = (Duration::from_millis(300), Duration::from_secs(600));
        let rest = Duration::from_millis(20);
        let still = said(0, rest, Timeouts { standstill: short, picture: long }).unwrap();
        assert!(still.contains("nothing for 0.3 s"), "{still}");
        // 3 MiB a second: there is always progress.
        let slow = said(1 << 16, rest, Timeouts { standstill: long, picture: short }).unwrap();
        assert!(slow.contains("more than 0.3 s for a picture"), "{slow}");
        // Negative control.
        let quick = said(1 << 22, Duration::ZERO, Timeouts { standstill: long, picture: long });
        assert_eq!(quick, None);
    }
}
