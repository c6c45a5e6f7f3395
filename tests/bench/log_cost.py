"""Measures the processor time of `cangauge log` and of `candump -l` on a virtual interface that is always full.

    log_cost.py BINARY BLAST IFACE SECONDS DIRECTORY

BLAST is the compiled blast.c. Both programs record for SECONDS, in turn. The cost of a frame is the processor time for
each frame that was recorded. The sequence numbers in the frames show which ones are missing.
"""

import os
import re
import signal
import statistics
import subprocess
import sys
import time

# Recordings that are longer than this number of seconds are made only once.
LONG = 60
RUNS = 3

# The first sequence number of blast.c.
FIRST = 1 << 24


def processor_seconds(process):
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(process):
    """The resident memory in MB."""
    with open(f"/proc/{process.pid}/status", encoding="ascii") as file:
        return int(re.search(r"VmRSS:\s+(\d+)", file.read())[1]) / 1000


def quiet(*command):
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def await_end(path):
    """Waits until a file has not grown for a second."""
    size = -1
    while size != os.path.getsize(path):
        size = os.path.getsize(path)
        time.sleep(1)


def blasted(process, path, blast, interface, seconds):
    """The number of frames sent, the processor seconds of `process`, and its memory before and after."""
    before, start = memory(process), processor_seconds(process)
    sent = int(subprocess.run([blast, interface, seconds], capture_output=True, text=True, check=True).stdout)
    await_end(path)
    took, after = processor_seconds(process) - start, memory(process)
    process.send_signal(signal.SIGINT)
    process.wait()
    return sent, took, before, after


def record(binary, blast, interface, seconds, directory):
    """Sent frames, processor seconds, lost frames and memory of cangauge."""
    rows = os.path.join(directory, "rows.csv")
    devices = quiet(binary, "-q", "-b", interface, "sim", "dps@1", "dps@2", "dps@3", "dps@4")
    time.sleep(1)
    log = quiet(binary, "-q", "-b", interface, "log", "1-4", "-o", rows, "--force")
    time.sleep(4)
    devices.terminate()
    devices.wait()
    time.sleep(1)
    sent, took, before, after = blasted(log, rows, blast, interface, seconds)
    with open(rows, encoding="ascii") as file:
        next(file)
        expected, lost = FIRST, 0
        for line in file:
            number = int.from_bytes(bytes.fromhex(line.rsplit(",", 1)[1].strip()[2:]), "little")
            # The rows of the simulated devices have smaller numbers.
            if number >= FIRST:
                lost += number - expected
                expected = number + 1
    os.remove(rows)
    return sent, took, lost + FIRST + sent - expected, (before, after)


def dump(blast, interface, seconds, directory):
    """Sent frames, processor seconds and lost frames of candump."""
    os.chdir(directory)
    process = quiet("candump", "-l", interface)
    time.sleep(1)
    (name,) = [name for name in os.listdir(directory) if name.startswith("candump-")]
    sent, took, _, _ = blasted(process, name, blast, interface, seconds)
    with open(name, encoding="ascii") as file:
        lost = sent - sum(1 for _ in file)
    os.remove(name)
    return sent, took, lost


def report(name, sent, seconds, lost, cost, more=""):
    rate = f"{sent / float(seconds):8.0f} frames/s, {lost} of {sent} lost"
    print(f"log-cost   {name} {rate}, {cost:.1f} us for each frame{more}", flush=True)


def main():
    binary, blast, interface, seconds, directory = sys.argv[1:]
    ratios = []
    for _ in range(RUNS if float(seconds) <= LONG else 1):
        sent, took, lost, (before, after) = record(binary, blast, interface, seconds, directory)
        own = took / (sent - lost) * 1e6
        report("cangauge:", sent, seconds, lost, own, f", memory {before:.1f} to {after:.1f} MB")
        sent, took, lost = dump(blast, interface, seconds, directory)
        other = took / (sent - lost) * 1e6
        report("candump: ", sent, seconds, lost, other)
        ratios.append(own / other)
    print(f"log-cost   cangauge, processor time relative to candump -l (limit 0.40) {statistics.median(ratios):.2f}")


if __name__ == "__main__":
    main()
