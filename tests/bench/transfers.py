"""Measures the SDO transfers of cangauge, python-canopen and a minimal client (bare.c).

    transfers.py BINARY BARE IFACE [RUNS]

All three use the same simulated device in its own process, in turns. The table shows the medians of RUNS (5) runs.
Compare only figures of one run. BARE is the compiled bare.c. The start-up time of cangauge is measured with a minimal
transfer and subtracted.

    cargo build --release
    cc -O2 -o target/bare tests/bench/bare.c
    tests/socketcan/vcan -t 900 target/peers/bin/python tests/bench/transfers.py target/release/cangauge target/bare vcan0
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "peers"))

from harness import Cangauge  # noqa: E402
from transfers import NODE, PythonMaster, simulated  # noqa: E402

READS = 2000
SIZE = 100_000


def seconds(action):
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


class Clients:
    """The figures of each client, in seconds."""

    def __init__(self, cangauge, bare, directory):
        self.cangauge, self.bare, self.directory = cangauge, bare, directory
        self.data = os.path.join(directory, "data")
        with open(self.data, "wb") as file:
            file.write(os.urandom(SIZE))

    def run_bare(self, what, number):
        done = subprocess.run([self.bare, self.cangauge.interface, str(NODE), what, str(number)], capture_output=True, text=True, check=True)
        return float(done.stdout)

    def run_cangauge(self, *arguments):
        return seconds(lambda: self.cangauge.run("sdo", *arguments))

    def run_python(self, action):
        # Connect only for the measurement: a connected network processes all frames, and all clients share one CPU.
        with PythonMaster(self.cangauge.interface) as master:
            return seconds(lambda: action(master))

    def transfer(self, block, upload):
        output = os.path.join(self.directory, "output")
        if upload:
            return self.run_cangauge("read", NODE, "2000", "--type", "d", "--block", block, "--output", output, "--force") - self.start()
        return self.run_cangauge("write", NODE, "2000", "--block", block, "--input", self.data) - self.start()

    def start(self):
        return self.run_cangauge("read", NODE, "2002", "--type", "u32")

    def figures(self):
        """Name, cangauge, python-canopen, bare."""
        with open(self.data, "rb") as file:
            data = file.read()
        yield "expedited reads", \
            self.run_cangauge("read", NODE, *["2002"] * READS, "--type", "u32") - self.start(), \
            self.run_python(lambda master: [master.sdo.upload(0x2002, 0) for _ in range(READS)]), \
            self.run_bare("reads", READS)
        for block in ("never", "always"):
            name, blocks, kind = ("segmented", False, "") if block == "never" else ("block", True, "block-")
            yield f"{name} download", self.transfer(block, False), \
                self.run_python(lambda master: master.write(0x2000, data, blocks)), self.run_bare(f"{kind}write", SIZE)
            yield f"{name} upload", self.transfer(block, True), \
                self.run_python(lambda master: master.read(0x2000, blocks)), self.run_bare(f"{kind}read", SIZE)


def main():
    binary, bare, interface, *runs = sys.argv[1:]
    cangauge = Cangauge(os.path.abspath(binary), interface)
    taken = {}
    with tempfile.TemporaryDirectory() as directory, simulated(cangauge, directory):
        clients = Clients(cangauge, os.path.abspath(bare), directory)
        clients.transfer("always", False)
        for _ in range(int(runs[0]) if runs else 5):
            for name, *times in clients.figures():
                taken.setdefault(name, []).append(times)
    print(f"{'':20}{'cangauge':>12}{'python':>12}{'bare':>12}{'of python':>12}{'of bare':>12}")
    for name, rows in taken.items():
        amount, unit = (READS, "/s") if name == "expedited reads" else (SIZE / 1000, " kB/s")
        ours, python, bare = (amount / statistics.median(column) for column in zip(*rows))
        of_python = statistics.median(row[1] / row[0] for row in rows)
        of_bare = statistics.median(row[2] / row[0] for row in rows)
        print(f"{name:20}" + "".join(f"{figure:>12.1f}" for figure in (ours, python, bare)) + f"{of_python:>12.2f}{of_bare:>12.2f}  {unit.strip()}")


if __name__ == "__main__":
    main()
