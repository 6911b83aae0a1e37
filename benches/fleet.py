#!/usr/bin/env python3
"""What a unit costs a worker, the server and the collector of a fleet, at several sizes, and how many workers follow.

    cargo build --release --features fleet
    benches/fleet.py [--program target/release/stride] [--sizes 1920x1080,3840x2160] [--units 4,12]
    benches/fleet.py --pairs 5    two workers of one thread against a render of two threads, in turns
    benches/fleet.py --try        tiny pictures: shows that the script works

Starts nats-server on a free port of this machine. A job of units of one sample is rendered by one worker while nobody
collects, so that the server stores all results. Then they are collected. This is done with two numbers of units, and the
difference is what further units cost: the scene, the outputs and the checkpoint are in both.

With --pairs, seconds are those from the start of `submit` or `render` to its end; workers wait for jobs before. Processor
seconds are those of all processes together, server and workers included: on a busy machine, only these can be compared.
"""
import argparse, json, os, pathlib, re, statistics, subprocess, sys, tempfile, threading, time

parser = argparse.ArgumentParser()
parser.add_argument("--program", default=os.environ.get("STRIDE", "target/release/stride"))
parser.add_argument("--sizes", default="16x12,1920x1080,3840x2160")
parser.add_argument("--units", default="4,12")
parser.add_argument("--pairs", type=int, default=0)
parser.add_argument("--size", default="640x360")
parser.add_argument("--spp", default="512")
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
        """Bytes of the results on the server."""
        return sum(path.stat().st_size for path in (self.folder / "store").rglob("*") if path.is_file())

    def units(self, size, count):
        """Seconds of rendering, of a worker in all, and of collecting so many units, and their bytes on the server."""
        before = self.stored()
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
        stored = self.stored() - before
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
                                            "-o", "two.exr", "--cache", "cache"), cwd=folder)
    used = seconds_of(process)
    took = time.monotonic() - start
    for worker in workers:
        worker.terminate()
        used += seconds_of(worker)
    return took, used + fleet.end()


if arguments.pairs or arguments.short:
    print("s and processor s of --threads 2, the same of two workers, ratios of the first to the second, load")
    ratios = []
    for _ in range(max(arguments.pairs, 1)):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            alone, two = render_alone(folder), render_by_two(folder)
            if (folder / "alone.exr").read_bytes() != (folder / "two.exr").read_bytes():
                raise SystemExit("the pictures differ")
        ratios.append([a / b for a, b in zip(alone, two)])
        print(*(f"{x:.2f}" for x in (*alone, *two, *ratios[-1], os.getloadavg()[0])), sep=", ", flush=True)
    print("medians:", *(f"{statistics.median(column):.3f}" for column in zip(*ratios)))
    if not arguments.short:
        raise SystemExit

print("size, MB of a film, MB on the way, s of packing and sending, s of collecting, s of the collector's CPU, units/s, MB/s, "
      "workers at 10, 30, 60 s")
for size in arguments.sizes.split(","):
    rows = []
    for count in (few, many):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            fleet = Fleet(folder)
            try:
                rows.append(fleet.units(size, count))
            finally:
                fleet.end()
    (_, short, stored_few, _), (times, long, stored_many, film) = rows
    collecting, computing = ((b - a) / (many - few) for a, b in zip(short, long))
    packed = (stored_many - stored_few) / (many - few)
    # The first unit includes compiling the scene. The others are taken one after the other.
    spans = [later[0] - earlier[0] - later[1] for earlier, later in zip(times[1:], times[2:])]
    sending = sorted(spans)[len(spans) // 2] if spans else float("nan")
    workers = [int(unit / collecting) if collecting > 0 else 0 for unit in (10, 30, 60)]
    print(f"{size}, {film / 1e6:.1f}, {packed / 1e6:.2f}, {sending:.3f}, {collecting:.3f}, {computing:.3f}, {1 / collecting:.1f}, "
          f"{packed / 1e6 / collecting:.1f}, {workers}")
    sys.stdout.flush()
