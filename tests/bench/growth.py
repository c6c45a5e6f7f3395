"""How cost grows: with the bit rate of the bus, with the latency of a gateway, with nodes, frames and expressions."""

import os
import re
import subprocess

from common import BINARY, BIT_RATE, HERE, Traced, bits, in_turn, processor_seconds, report, run

SIZE = 100_000

# The latency of a gateway: each answer arrives later by this time.
LATENCY_MS = 5

COMMANDS = [
    "scan",
    "info 5",
    "read 5",
    "check 5 pressure<100psi",
    "sdo read 5 1000",
    "sdo write 5 0x1017 100",
    "log 5 --count 1",
    "nmt start 5",
    "nmt reset 5",
    "unit 5",
    "unit 5 bar",
    "errors 5",
    "pdo show 5",
    "config dump 5",
    "store 5",
    "lss scan",
    "lss set-id 5 12",
]


def store(directory, content):
    """The description of a device with an object (2000h) of any size."""
    with open(os.path.join(HERE, "..", "peers", "transfers.py"), encoding="utf-8") as file:
        described = re.search(r'SIMULATED = """\n(.*?)"""', file.read(), re.DOTALL)[1]
    before, object_2000, after = re.split(r'(at = "0x2000".*?\n\n)', described, maxsplit=1, flags=re.DOTALL)
    object_2000 = re.sub('default = ".*"', f'default = "0x{content.hex()}"', object_2000)
    with open(os.path.join(directory, "store.toml"), "w", encoding="ascii") as file:
        file.write(before + object_2000 + after)


def paced(directory):
    """large transfers, share of the wire time of 1 Mbit/s"""
    content, file = os.urandom(SIZE), os.path.join(directory, "content")
    store(directory, content)
    for form, block in (("segmented", "never"), ("block", "always")):
        read = ["sdo", "read", 1, "2000", "--type", "d", "--block", block, "--output", file, "--force"]
        write = ["sdo", "write", 1, "2000", "--block", block, "--input", file]
        for name, command in (("upload", read), ("download", write)):
            traced = Traced(directory, ['kind = "store.toml"\nnode = 1'], *command)
            with open(file, "rb") as moved:
                assert moved.read() == content
            wire = sum(bits(frame) for _, frame in traced.frames) / 1e6
            last = bits(traced.frames[-1][1]) / 1e6
            report("paced", f"{form} {name} of {SIZE // 1000} kB, 1 Mbit/s", traced.length() + last, "s", f"frames on the wire {wire:.3f} s", wire / (traced.length() + last))


def latency(directory):
    """what a gateway costs each command"""
    device = 'kind = "dps"\nnode = 5'
    for line in COMMANDS:
        near, far = (Traced(directory, [device + more], *line.split()).length() for more in ("", f'\nlatency = "{LATENCY_MS}ms"'))
        report("latency", line, far, "s", f"without latency {near:.3f} s; waits", (far - near) * 1000 / LATENCY_MS)


# The mean length of a line in a recording, in bytes.
LINE = 38


def growth(directory, largest=8):
    """growth of cost with nodes, frames and expressions"""
    for nodes in (1, 4, 16, 64, 127):
        devices = [f'kind = "mh4"\nnode = {node}' for node in range(1, nodes + 1)]
        length = Traced(directory, devices, "scan", bit_rate=BIT_RATE).length()
        report("growth", f"scan, {nodes} nodes, 250 kbit/s", length, "s", "per node, ms", length * 1000 / nodes)
        log = ["log", f"1-{nodes}", "--max-load", "100%", "--sync", "200ms", "--duration", "1s", "-o", os.path.join(directory, "rows"), "--force"]
        sent, first = set(), 0
        for at, frame in Traced(directory, devices, *log, bit_rate=BIT_RATE).frames:
            if re.match("(1[89A-F]|200?).#", frame):
                sent.add(frame[:3])
                first = first or (at if len(sent) == nodes else 0)
        report("growth", f"log, {nodes} nodes, first complete cycle", first, "s", "per node, ms", first * 1000 / nodes)
    recording = os.path.join(directory, "frames.log")
    setup = [frame for _, frame in Traced(directory, ['kind = "dps"\nnode = 1'], "log", "1", "--duration", "1s").frames]
    for exponent in range(3, largest + 1):
        write_recording(recording, setup, max(1, 10**exponent // LINE - len(setup)))
        log = [BINARY, "-q", "-b", "replay:" + recording, "log", "1", "--passive", "-o", os.path.join(directory, "rows"), "--force"]
        took, memory = measured(log)
        size = os.path.getsize(recording)
        report("growth", f"replay, {size / 1e6:.3f} MB, {memory:.1f} MB memory", took, "s", "per frame, us", took * 1e6 * LINE / size)
    frames = 10**5
    write_recording(recording, setup, frames)
    for count in (1, 10, 100, 1000):
        expressions = [f"pressure in {number / 1000}..100 psi" for number in range(count)]
        (took,) = in_turn(processor_seconds, lambda: run(BINARY, "-q", "-b", "replay:" + recording, "check", "1", *expressions))
        report("growth", f"check, {count} expressions, 10^5 samples", took, "s", "per expression and sample, ns", took * 1e9 / frames / count)


def write_recording(name, setup, frames):
    """A recording of the set-up of one DPS, and this many of its TPDOs, one each millisecond."""
    with open(name, "w", encoding="ascii") as file:
        for number, frame in enumerate(setup):
            file.write(f"(1800000000.{number:06}) can0 {frame}\n")
        for number in range(frames):
            value = (18_000 + number * 7919 % 2000).to_bytes(4, "little").hex().upper()
            file.write(f"({1_800_000_001 + number // 1000}.{number % 1000:03}000) can0 181#{value}\n")


def measured(command):
    """The processor time in seconds and the peak memory in MB of a command."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, command
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000
