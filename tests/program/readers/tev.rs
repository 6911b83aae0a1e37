//! The picture as received by the viewer tev, here by a server that was written from tev's
//! documentation ("IPC", <https://github.com/Tom94/tev>). All numbers are little-endian: a length that includes itself,
//! a kind, and the contents of that kind.

use std::collections::HashMap;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use stride::output::read_picture;

/// A packet that is read from the front.
struct Packet<'a>(&'a [u8]);

impl Packet<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (bytes, rest) = self.0.split_first_chunk().expect("the packet has more");
        self.0 = rest;
        *bytes
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn u64(&mut self) -> usize {
        u64::from_le_bytes(self.bytes()) as usize
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).expect("a NUL");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }

    fn texts(&mut self) -> Vec<String> {
        (0..self.u32()).map(|_| self.text()).collect()
    }
}

/// The state of a tev.
#[derive(Default)]
struct Shown {
    name: String,
    size: (u32, u32),
    channels: HashMap<String, Vec<f32>>,
    /// The number of changes of the first rows.
    changes: u32,
}

impl Shown {
    fn take(&mut self, packet: &[u8]) {
        let mut packet = Packet(packet);
        match packet.bytes::<2>() {
            [4, 1] => {
                self.name = packet.text();
                self.size = (packet.u32(), packet.u32());
                let black = vec![0.0; (self.size.0 * self.size.1) as usize];
                self.channels = packet.texts().into_iter().map(|name| (name, black.clone())).collect();
            }
            [6, 0] => {
                assert_eq!(packet.text(), self.name);
                let names = packet.texts();
                let [x, y, width, height] = [(); 4].map(|()| packet.u32());
                assert!(x + width <= self.size.0 && y + height <= self.size.1);
                let offsets: Vec<_> = names.iter().map(|_| packet.u64()).collect();
                let strides: Vec<_> = names.iter().map(|_| packet.u64()).collect();
                let data: Vec<_> =
                    packet.0.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
                packet.0 = &[];
                for (name, (offset, stride)) in names.iter().zip(offsets.into_iter().zip(strides)) {
                    let channel = self.channels.get_mut(name).expect("a channel of the picture");
                    let before = channel.clone();
                    for i in 0..width * height {
                        let place = (y + i / width) * self.size.0 + x + i % width;
                        channel[place as usize] = data[offset + i as usize * stride];
                    }
                    self.changes += u32::from(y == 0 && *channel != before);
                }
            }
            other => panic!("a packet that begins with {other:?}"),
        }
        assert!(packet.0.is_empty(), "a packet is longer than it should be");
    }

    fn pixels(&self) -> Vec<[u32; 3]> {
        let [r, g, b] = ["R", "G", "B"].map(|name| &self.channels[name]);
        (0..r.len()).map(|i| [r[i], g[i], b[i]].map(f32::to_bits)).collect()
    }
}

fn next_packet(from: &mut TcpStream) -> Option<Vec<u8>> {
    let mut length = [0; 4];
    from.read_exact(&mut length).ok()?;
    let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
    from.read_exact(&mut packet).ok()?;
    Some(packet)
}

/// Renders with a tev that receives at most this number of packets.
fn render(folder: &Path, packets: usize, more: &[&str]) -> (Shown, Output) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let tev = std::thread::spawn(move || {
        let (mut socket, _) = listener.accept().expect("somebody calls");
        let mut shown = Shown::default();
        for packet in std::iter::from_fn(|| next_packet(&mut socket)).take(packets) {
            shown.take(&packet);
        }
        shown
    });
    let output = stride(folder, &address, more).output().expect("stride runs");
    (tev.join().expect("packets as they should be"), output)
}

fn stride(folder: &Path, tev: &str, more: &[&str]) -> Command {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml");
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.args(["render", scene, "--headless", "--quiet", "--tev", tev, "-o", "a.exr"]).args(more);
    command.current_dir(folder);
    command
}

fn written(folder: &Path) -> Vec<[u32; 3]> {
    let (_, picture) = read_picture(&folder.join("a.exr")).expect("a picture");
    picture.rgb.iter().map(|rgb| rgb.map(f32::to_bits)).collect()
}

#[test]
fn tev_gets_intermediate_pictures_and_the_final_one() {
    let folder = tempfile::tempdir().expect("a folder");
    // More pixels than one packet contains, and a few passes.
    let large = ["--size", "640x480", "--spp", "12", "--integrator", "path-naive"];
    let (shown, output) = render(folder.path(), usize::MAX, &large);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!((shown.name.as_str(), shown.size), ("cover.toml", (640, 480)));
    assert!(shown.pixels() == written(folder.path()));
    assert!(shown.changes >= 3 * 2, "it was shown {} times", shown.changes / 3);
    // Negative control: another render's picture differs.
    render(folder.path(), usize::MAX, &[&large[..], &["--seed", "1"]].concat());
    assert!(shown.pixels() != written(folder.path()));
}

#[test]
fn a_render_continues_when_tev_disconnects() {
    let folder = tempfile::tempdir().expect("a folder");
    let small = ["--size", "64x48", "--spp", "2000"];
    let (_, output) = render(folder.path(), 2, &small);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success() && told.contains("warning: the connection to tev at 127.0.0.1:"),
        "{told}"
    );
    let alone = written(folder.path());
    let (_, output) = render(folder.path(), usize::MAX, &small);
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(written(folder.path()) == alone, "who watches changes nothing");
}

// `processes/stopping.rs` tests that files do not wait for it.
#[test]
fn a_render_continues_when_tev_does_not_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    // 24 MB: more than the buffers of sockets.
    let large = ["--size", "1920x1080", "--spp", "2", "--integrator", "path-naive"];
    let stride = stride(folder.path(), &address, &large).stderr(Stdio::piped()).spawn();
    let stride = stride.expect("stride starts");
    let socket = listener.accept().expect("somebody calls");
    let output = stride.wait_with_output().expect("it ends");
    drop(socket);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && told.contains("it has received nothing for 5 s"), "{told}");
    let without = written(folder.path());
    render(folder.path(), usize::MAX, &large);
    assert!(written(folder.path()) == without);
}
