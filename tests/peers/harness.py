"""Common parts of the checks with python-canopen: the program, the devices, the bus.

The checks do not depend on the speed of the machine: they wait for each expected event, for GIVE_UP at most.
"""

import contextlib
import csv
import json
import math
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import traceback

HERE = os.path.dirname(os.path.abspath(__file__))
# After this time the machine counts as hung.
GIVE_UP = 120
# The time-out of cangauge for expected answers; long enough for a slow machine.
PATIENT = ["--timeout", "20s"]

# The columns of layout "long" without the times.
MEASURED = ["node", "signal", "value", "unit", "status", "raw"]


class Result:
    """The result of a run of cangauge."""

    def __init__(self, command, exit_code, out, err, seconds):
        self.command, self.exit, self.out, self.err, self.seconds = command, exit_code, out, err, seconds

    def __str__(self):
        return f"{' '.join(self.command)}\nexit {self.exit} after {self.seconds:.2f} s\n--- stdout\n{self.out}--- stderr\n{self.err}---"

    def json(self):
        return [json.loads(line) for line in self.out.splitlines()]

    def rows(self):
        return rows_of(self.out)


class Cangauge:
    """The program under test, on one interface."""

    def __init__(self, binary, interface):
        self.binary, self.interface = binary, interface

    def command(self, *arguments, bus=None):
        return [self.binary, "--bus", bus or self.interface, *map(str, arguments)]

    def run(self, *arguments, exit=0, bus=None):
        """Runs it and waits for its end. `exit` is the expected exit code; None allows any."""
        command = self.command(*arguments, bus=bus)
        started = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, timeout=GIVE_UP, stdin=subprocess.DEVNULL)
        result = Result(command, done.returncode, done.stdout, done.stderr, time.monotonic() - started)
        assert exit is None or result.exit == exit, f"exit code {exit} expected\n{result}"
        return result

    @contextlib.contextmanager
    def running(self, *arguments, directory, bus=None):
        """Starts it in the background. The caller may end it with Recording.finish()."""
        recording = Recording(self.command(*arguments, bus=bus), directory)
        try:
            yield recording
        finally:
            recording.kill()

    @contextlib.contextmanager
    def simulator(self, bench, directory, bus=None):
        """Simulated devices in a separate process, connected to the interface like any program."""
        with self.running("sim", bench, directory=directory, bus=bus) as simulator:
            wait_for(lambda: "simulation is running" in simulator.text("err"),
                     lambda: f"no simulator: {simulator.text('err')}")
            yield simulator


class Recording:
    """A run of cangauge in the background. Its output goes to files."""

    def __init__(self, command, directory):
        self.command = command
        self.paths = {name: os.path.join(directory, f"{time.monotonic_ns()}.{name}") for name in ("out", "err")}
        self.started = time.monotonic()
        with open(self.paths["out"], "w") as out, open(self.paths["err"], "w") as err:
            self.process = subprocess.Popen(command, stdout=out, stderr=err, stdin=subprocess.DEVNULL)

    def text(self, name):
        with open(self.paths[name], encoding="utf-8") as file:
            return file.read()

    def rows(self):
        """The rows written so far."""
        text = self.text("out")
        return rows_of(text[: text.rfind("\n") + 1])

    def await_rows(self, count):
        """Waits for this number of rows."""
        wait_for(lambda: len(self.rows()) >= count, lambda: f"{len(self.rows())} of {count} rows\n{self.text('err')}", self.process)

    def await_words(self, words):
        """Waits for this text on stderr."""
        wait_for(lambda: words in self.text("err"), lambda: f"never said: {words}\n{self.text('err')}", self.process)

    def is_running(self):
        return self.process.poll() is None

    def finish(self, exit=0, end=signal.SIGINT):
        """Ends it with Ctrl-C (None: waits until it ends) and returns the result."""
        if end:
            self.process.send_signal(end)
        self.process.wait(GIVE_UP)
        seconds = time.monotonic() - self.started
        result = Result(self.command, self.process.returncode, self.text("out"), self.text("err"), seconds)
        assert exit is None or result.exit == exit, f"exit code {exit} expected\n{result}"
        return result

    def kill(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(GIVE_UP)
            except subprocess.TimeoutExpired:
                self.process.kill()
                raise


def wait_for(condition, complaint, process=None):
    """Waits for a condition. `process` makes it true, so the end of the process is a failure."""
    until = time.monotonic() + GIVE_UP
    while not condition():
        ended = process is not None and process.poll() is not None
        assert time.monotonic() < until and not (ended and not condition()), complaint()
        time.sleep(0.02)


def rows_of(text):
    """The rows of a CSV, as dictionaries."""
    return list(csv.DictReader(text.splitlines()))


def measured(rows, *nodes):
    """The measured values in order: tuples of MEASURED. With `nodes`, only of these nodes."""
    return [tuple(row[name] for name in MEASURED) for row in rows if not nodes or int(row["node"]) in nodes]


@contextlib.contextmanager
def devices(interface, directory, *nodes, period=20, sync=0, heartbeat=0, quiet=False):
    """python-canopen devices made by device.py. Yields a function that converts their record to the rows that
    cangauge should print."""
    record = os.path.join(directory, f"{time.monotonic_ns()}.record")
    command = [sys.executable, os.path.join(HERE, "device.py"), "--record", record, "--period", str(period)]
    command += ["--heartbeat", str(heartbeat), *(["--sync", str(sync)] if sync else []), *(["--quiet"] if quiet else []), interface, *nodes]
    kinds = {int(node.split(":")[0]): node.split(":")[1] for node in nodes}

    def read(*wanted):
        with open(record, encoding="ascii") as file:
            lines = [line.strip().split(",") for line in file.read().splitlines(keepends=True) if line.endswith("\n")]
        return [expected(kinds[int(node)], int(node), int(number)) for node, number, *_ in lines
                if not wanted or int(node) in wanted]

    process = subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout.readline() == "ready\n", "device.py did not start"
        yield read
    finally:
        process.terminate()
        status = process.wait(GIVE_UP)
    assert status == 0, f"device.py: exit status {status}"


def expected(kind, node, number):
    """The row for the n-th TPDO of a device of device.py. It follows the documentation, not the code of
    cangauge."""
    if kind == "integer":
        value = 7 * number - 5000
        return (str(node), "ch1", f"{value / 1000:.3f}", "psi", "", wire("<i", value))
    value, status = number * 0.25 - 100, "ok"
    if kind == "overload" and number % 8 in (5, 6):
        return (str(node), "ch1", "", "bar", "overload-high" if number % 8 == 5 else "overload-low", wire("<f", math.nan))
    if kind == "overload" and number % 8 == 7:
        return (str(node), "ch1", "", "bar", "invalid", wire("<f", value))
    return (str(node), "ch1", f"{value:g}", "bar", status, wire("<f", value))


def wire(form, value):
    return "0x" + struct.pack(form, value).hex().upper()


def begins(rows, record):
    """Checks that the rows are the beginning of the record: none missing, added or changed."""
    assert rows, "no rows"
    assert len(rows) <= len(record), f"{len(rows)} rows of {len(record)} TPDOs"
    for number, (row, sent) in enumerate(zip(rows, record)):
        assert row == sent, f"row {number} is {row} and was sent as {sent}"


def stands_in(rows, record):
    """Checks that each row is in the record, in the same order: none added, changed or repeated. Rows may be missing."""
    assert rows, "no rows"
    rest = iter(record)
    for number, row in enumerate(rows):
        assert any(row == sent for sent in rest), f"row {number}, {row}, was not sent there"


class Wire:
    """A raw CAN socket for frames that no correct participant sends."""

    ERROR, REMOTE, EXTENDED = socket.CAN_ERR_FLAG, socket.CAN_RTR_FLAG, socket.CAN_EFF_FLAG

    def __init__(self, interface):
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        # It only sends.
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"")
        self.socket.bind((interface,))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, identifier, data=b"", length=None):
        """A classic frame; `length` is that of a remote frame, which has no data."""
        self._send(struct.pack("=IB3x8s", identifier, len(data) if length is None else length, bytes(data)))

    def send_fd(self, identifier, data, flags=0):
        """A CAN FD frame."""
        self._send(struct.pack("=IBB2x64s", identifier, len(data), flags, bytes(data)))

    def _send(self, frame):
        while True:
            try:
                self.socket.send(frame)
                return
            except OSError as error:
                # The queue is full: retry later.
                if error.errno != 105:
                    raise
                time.sleep(0.001)


def run_checks(binary, interface, checks, names=()):
    """Runs the checks, each with its arguments, or only those named. Returns the exit status."""
    known = {check.__name__ for check, _ in checks}
    assert set(names) <= known, f"there are: {', '.join(sorted(known))}"
    os.environ.update(LC_ALL="C", TERM="dumb")
    os.environ.pop("CANGAUGE_BUS", None)
    cangauge = Cangauge(os.path.abspath(binary), interface)
    passed, failed = 0, []
    for check, arguments in checks:
        if names and check.__name__ not in names:
            continue
        started = time.monotonic()
        with tempfile.TemporaryDirectory() as directory, tempfile.TemporaryDirectory() as state:
            # Commands refuse to run if they find the journal of another run on this computer.
            os.environ["XDG_STATE_HOME"] = state
            try:
                check(cangauge, directory, *arguments)
                passed += 1
                word = "ok    "
            # A failed check does not stop the next one.
            except Exception:
                traceback.print_exc(file=sys.stdout)
                failed.append(check.__name__)
                word = "FAILED"
        print(f"{word} {check.__name__} ({time.monotonic() - started:.1f} s)", flush=True)
    if failed:
        print(f"failed: {', '.join(failed)}")
    print(f"{passed} passed, {len(failed)} failed")
    return 1 if failed else 0
