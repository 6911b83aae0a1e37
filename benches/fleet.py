#!/usr/bin/env python3
"""What a unit costs a worker, the server and the collector of a fleet, at several sizes, and how many workers follow.

    cargo build --release --features fleet
    benches/fleet.py [--program target/release/stride] [--sizes 1920x1080,3840x2160] [--units 4,12]
    benches/fleet.py --pairs 3    two workers of one thread against a render of two threads, in turns: 4 minutes on two cores
    benches/fleet.py --pairs 1 --spp 4096 --unit 30s    the same for a longer job and longer units: six minutes
    benches/fleet.py --try        tiny pictures: shows that the script works

Starts nats-server on a free port of this machine. A job of units of one sample is rendered by one worker while nobody
collects, so that the server stores all results. Then they are collected. This is done with two numbers of units, and the
difference is what further units cost: the scene, the outputs and the checkpoint are in both.

Processor seconds are those of user and system. Of the collector they are what the model of docs/fleet.md needs; seconds of
collecting also contain the server's work, and whatever else the machine does.

With --pairs, seconds are those from the start of `submit` or `render` to its end; workers wait for jobs before. Ratios
are those of `render` to the fleet: 0.95 is 95 % of its speed. Only a quiet machine gives valid ones: units are sized by seconds,
so that on a busy machine they have fewer samples, and their fixed costs weigh more in processor seconds, too.
"""
import argparse, json, os, pathlib, re, socket, statistics, subprocess, sys, tempfile, threading, time

parser = argparse.ArgumentParser()
parser.add_argument("--program", default=os.environ.get("STRIDE", "target/release/stride"))
parser.add_argument("--sizes", default="16x12,1920x1080,3840x2160")
parser.add_argument("--units", default="4,12")
parser.add_argument("--pairs", type=int, default=0)
parser.add_argument("--size", default="640x360")
parser.add_argument("--spp", default="768")
parser.add_argument("--unit", default="10s")
parser.add_argument("--try", dest="short", action="store_true")
arguments = parser.parse_args()
if arguments.short:
    arguments.sizes, arguments.units, arguments.size, arguments.spp = "16x12", "1,3", "16x12", "8"
program = os.path.abspath(arguments.program)
few, many = map(int, arguments.units.split(","))

# A box: no pixel is empty, and none is without noise.
SCENE = pathlib.Path(__file__).resolve().parent.parent / "scenes" / "smallpt.toml"


class Fleet:
    """A server in a folder of its own."""

    def __init__(self, folder):
        self.folder = folder
        self.server = subprocess.Popen(
            ["nats-server", "-a", "127.0.0.1", "-p", "-1", "-js", "-sd", "store", "--ports_file_dir", "."], cwd=folder,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        ports = folder / f"nats-server_{self.server.pid}.ports"
        until = time.monotonic() + 30
        self.url = None
        while self.url is None:
            try:
                self.url = json.loads(ports.read_text())["nats"][0]
            except (OSError, ValueError):
                if time.monotonic() > until:
                    raise SystemExit("nats-server does not start")
                time.sleep(0.02)

    def stride(self, *command):
        return [program, *map(str, command), "--broker", self.url]

    def run(self, *command):
        return subprocess.run(self.stride(*command), cwd=self.folder, check=True, capture_output=True, text=True).stdout.strip()

    def stored(self):
        """Bytes of the results on the server, as it states them: its files may lag behind."""
        host, port = self.url.removeprefix("nats://").rsplit(":", 1)
        with socket.create_connection((host, int(port))) as connection, connection.makefile("rb") as lines:
            connection.sendall(b'CONNECT {"verbose":false}\r\nSUB answer 1\r\nPUB $JS.API.STREAM.INFO.STRIDE_RESULTS answer 0\r\n\r\n')
            for line in lines:
                if line.startswith(b"MSG answer"):
                    return json.loads(lines.readline())["state"]["bytes"]

    def units(self, size, count):
        """Seconds of rendering, of a worker in all, and of collecting so many units, and their bytes on the server."""
        fixed = ["--size", size, "--unit", "1ms", "--spp", count, "--detach", "-q", "--cache", "cache"]
        job = self.run("submit", SCENE, "--max-depth", 3, *fixed)
        worker = subprocess.Popen(self.stride("work", "--name", "w", "--cache", "cache"), cwd=self.folder,
                                  stderr=subprocess.PIPE, text=True)
        times = []
        for line in worker.stderr:
            found = re.search(r"samples \d+\.\.\d+ in ([0-9.]+) s", line)
            if found:
                times.append((time.monotonic(), float(found[1])))
            if len(times) == count:
                break
        worker.kill()
        worker.wait()
        stored = self.stored()
        start = time.monotonic()
        collector = subprocess.Popen(
            self.stride("jobs", "collect", job, "-q", "--film", "x.film", "--checkpoint", "1h", "--cache", "cache"),
            cwd=self.folder)
        _, status, used = os.wait4(collector.pid, 0)
        if status != 0:
            raise SystemExit("the collector fails")
        collecting = time.monotonic() - start, used.ru_utime + used.ru_stime
        film = (self.folder / "x.film").stat().st_size
        self.run("jobs", "cancel", job)
        return times, collecting, stored, film

    def end(self):
        """Processor seconds of the server."""
        self.server.terminate()
        return seconds_of(self.server)


def seconds_of(process):
    """Processor seconds of a process that ends."""
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def render_alone(folder):
    start = time.monotonic()
    process = subprocess.Popen([program, "render", SCENE, "--headless", "-q", "--threads", "2", "--size", arguments.size,
                                "--spp", arguments.spp, "-o", "alone.exr"], cwd=folder)
    used = seconds_of(process)
    return time.monotonic() - start, used


def render_by_two(folder):
    fleet = Fleet(folder)
    workers = [subprocess.Popen(fleet.stride("work", "--threads", "1", "--name", name, "--cache", name), cwd=folder,
                                stderr=subprocess.PIPE, text=True) for name in ("a", "b")]
    for worker in workers:
        worker.stderr.readline()
        # What they say later is not read.
        threading.Thread(target=worker.stderr.read, daemon=True).start()
    start = time.monotonic()
    process = subprocess.Popen(fleet.stride("submit", SCENE, "-q", "--size", arguments.size, "--spp", arguments.spp,
                                            "--unit", arguments.unit, "-o", "two.exr", "--cache", "cache"), cwd=folder)
    collector = seconds_of(process)
    took = time.monotonic() - start
    for worker in workers:
        worker.terminate()
    rendering = sum(map(seconds_of, workers))
    return took, rendering, collector, fleet.end()


if arguments.pairs or arguments.short:
    print("s of --threads 2, s of the fleet, processor s of --threads 2, of the workers, of the collector, of the server, ratio of "
          "s, ratio of processor s, load")
    ratios = []
    for pair in range(max(arguments.pairs, 1)):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            # In turns, so that a change of the load favours neither.
            if pair % 2 == 0:
                alone, two = render_alone(folder), render_by_two(folder)
            else:
                two, alone = render_by_two(folder), render_alone(folder)
            if (folder / "alone.exr").read_bytes() != (folder / "two.exr").read_bytes():
                raise SystemExit("the pictures differ")
        (took, used), (took_by_two, *used_by_two) = alone, two
        ratios.append([took / took_by_two, used / sum(used_by_two)])
        shown = took, took_by_two, used, *used_by_two, *ratios[-1], os.getloadavg()[0]
        print(*(f"{x:.3f}" for x in shown), sep=", ", flush=True)
    print("medians of the ratios:", *(f"{statistics.median(column):.3f}" for column in zip(*ratios)))
    if not arguments.short:
        raise SystemExit

print("size, MB of a film, MB on the way, s of packing and sending, s of collecting, processor s of the collector, of the server, "
      "processor s of the scene and a checkpoint, units/s and MB/s of the collector's processor, workers at units of 10, 30, 60 s")
for size in arguments.sizes.split(","):
    rows = []
    for count in (few, many):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            fleet = Fleet(folder)
            try:
                row = fleet.units(size, count)
            finally:
                serving = fleet.end()
            rows.append((*row, serving))
    (_, short, stored_few, _, serving_few), (times, long, stored_many, film, serving_many) = rows
    collecting, computing = ((b - a) / (many - few) for a, b in zip(short, long))
    serving, rest = (serving_many - serving_few) / (many - few), short[1] - few * computing
    packed = (stored_many - stored_few) / (many - few)
    # The first unit includes compiling the scene. The others are taken one after the other.
    spans = [later[0] - earlier[0] - later[1] for earlier, later in zip(times[1:], times[2:])]
    sending = sorted(spans)[len(spans) // 2] if spans else float("nan")
    workers = [int(unit / computing) if computing > 0 else 0 for unit in (10, 30, 60)]
    print(f"{size}, {film / 1e6:.1f}, {packed / 1e6:.2f}, {sending:.3f}, {collecting:.3f}, {computing:.3f}, {serving:.3f}, {rest:.2f}, "
          f"{1 / max(computing, 1e-9):.1f}, {packed / 1e6 / max(computing, 1e-9):.1f}, {workers}")
    sys.stdout.flush()
