"""What the benches share: the program, the report, and commands on the simulated bus."""

import os
import shutil
import statistics
import subprocess
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
BINARY = os.path.abspath(os.environ.get("BINARY", os.path.join(ROOT, "target/release/cangauge")))
RUNS = 5
BIT_RATE = 250_000


class Skipped(Exception):
    """A bench cannot run here."""


def run(*command, **options):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True, **options)


def report(name, what, figure, unit, other, ratio):
    print(f"{name:10} {what:44} {figure:>10.3f} {unit:12} {other:36} {ratio:>6.2f}", flush=True)


def within(name, what, figure, unit, limit):
    report(name, what, figure, unit, f"limit {limit:g} {unit}", figure / limit)


def compiled(name, directory):
    if not shutil.which("cc"):
        raise Skipped("there is no cc")
    program = os.path.join(directory, name)
    run("cc", "-O2", "-o", program, os.path.join(HERE, name + ".c"))
    return program


def seconds(action):
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def processor_seconds(action):
    """The processor time of the processes that `action` starts and awaits."""
    before = os.times()
    action()
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def repeated(times, *command):
    """Starts a command several times from a shell, which starts programs faster than Python."""
    loop = f'for each in {" ".join(map(str, range(times)))}; do "$@" >/dev/null || exit; done'
    return lambda: run("sh", "-c", loop, "sh", *command)


def in_turn(measure, *actions):
    """The medians of several runs of each action."""
    taken = [[measure(action) for action in actions] for _ in range(RUNS)]
    return [statistics.median(column) for column in zip(*taken)]


class Traced:
    """A command on a simulated bus, with the frames and their times."""

    def __init__(self, directory, devices, *arguments, bit_rate=1_000_000, clock="virtual"):
        bench, trace = os.path.join(directory, "bench.toml"), os.path.join(directory, "trace.log")
        with open(bench, "w", encoding="ascii") as file:
            file.write(f'clock = "{clock}"\nbit_rate = {bit_rate}\n' + "".join(f"[[device]]\n{device}\n" for device in devices))
        start = time.perf_counter()
        run(BINARY, "-b", "sim:" + bench, "--trace", trace, *arguments)
        self.took = time.perf_counter() - start
        with open(trace, encoding="ascii") as file:
            lines = [line.split() for line in file]
        first = float(lines[0][0][1:-1])
        self.frames = [(float(at[1:-1]) - first, frame) for at, _, frame in lines]

    def length(self):
        return self.frames[-1][0]


def bits(frame):
    """The length of a frame on the wire: stuff bits and the pause to the next frame included (ISO 11898-1)."""
    number, data = frame.split("#")
    data = bytes.fromhex(data)
    content = f"0{int(number, 16):011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    crc = 0
    for bit in content:
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if int(bit) ^ crc >> 14 else 0)
    stuffed, last, count = 0, "", 0
    for bit in content + f"{crc:015b}":
        last, count = bit, count + 1 if bit == last else 1
        if count == 5:
            stuffed, last, count = stuffed + 1, "10"[int(bit)], 1
    return len(content) + 15 + stuffed + 13
