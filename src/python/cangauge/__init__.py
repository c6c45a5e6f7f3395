"""Find, read, check and record CANopen measuring devices from Python.

The package runs the program ``cangauge`` and returns its results as Python values:

    from cangauge import Gauge

    gauge = Gauge("can0")
    print(gauge.read(5, "pressure").value)

Nodes are given as on the command line: ``5``, ``"1-16"``, ``[1, 127]`` or ``"all"``. Times are seconds, or a text with
a unit (``"10ms"``). Further words are options of the command: ``gauge.scan("--passive")``.
"""

from __future__ import annotations

import importlib
import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Iterable, NamedTuple, Optional, Type, Union

__all__ = ["CheckFailed", "Gauge", "GaugeError", "Reading", "Recording", "program"]

Nodes = Union[int, str, Iterable[int]]
Duration = Union[float, str]
File = Union[str, "os.PathLike[str]"]
Row = dict[str, Any]

_log = logging.getLogger("cangauge")

# pytest shows the line of the test, not the lines of this file.
__tracebackhide__ = True


class GaugeError(Exception):
    """A command failed. Its kinds and exit codes are in ``man cangauge``."""

    def __init__(self, command: list[str], exit: int, errors: list[Row], rows: list[Row], text: str = "") -> None:
        first = errors[-1] if errors else {}
        #: The complete command line.
        self.command = command
        #: The exit code of the program. It is negative if a signal ended the program.
        self.exit = exit
        #: "no-answer", "refused", "bus" …; "partial" if some nodes succeeded; "unknown" without a report.
        self.kind: str = "partial" if exit == 7 else first.get("kind", "unknown")
        #: The messages of all nodes that failed.
        self.message = "; ".join(error["message"] for error in errors) or text.strip() or f"exit code {exit}"
        self.node: Optional[int] = first.get("node")
        self.object: Optional[str] = first.get("object")
        #: The SDO abort code, as text: "0x06020000".
        self.abort: Optional[str] = first.get("abort")
        #: The next step: a command to type, or one thing to check.
        self.hint: Optional[str] = first.get("hint")
        #: One object for each node that failed, with the fields above.
        self.errors = errors
        #: The results that were printed before the failure.
        self.rows = rows
        super().__init__(self.message)

    def __str__(self) -> str:
        return f"{self.message}\nhint: {self.hint}" if self.hint else self.message


class CheckFailed(GaugeError, AssertionError):
    """The measured values do not satisfy an expression. The message has one line for each failed expression."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        failed = [row for row in self.rows if row.get("verdict") not in (None, "ok")]
        nodes = {row["node"] for row in self.rows if "verdict" in row}
        if failed:
            where = [f"node {row['node']}: " if len(nodes) > 1 and row["node"] else "" for row in failed]
            lines = [f"{at}{row['expression']}: {row['findings']}" for at, row in zip(where, failed)]
            self.message = "FAIL  " + "\nFAIL  ".join(lines)


class Reading(NamedTuple):
    """A measured value. ``value`` is None if the device marks it as invalid; ``status`` is the reason."""

    node: int
    signal: str
    value: Optional[float]
    unit: Optional[str]
    status: Optional[str]


def program() -> str:
    """Returns the path of the program: the environment variable CANGAUGE, else beside Python, else in PATH."""
    scripts = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]
    beside = os.pathsep.join([os.path.dirname(sys.executable), *scripts])
    found = os.environ.get("CANGAUGE") or shutil.which("cangauge", path=beside) or shutil.which("cangauge")
    if not found:
        raise FileNotFoundError("the program cangauge is neither beside Python nor in PATH (environment: CANGAUGE)")
    return found


def _nodes(nodes: Nodes) -> str:
    return str(nodes) if isinstance(nodes, (int, str)) else ",".join(map(str, nodes))


def _options(**durations: Optional[Duration]) -> list[str]:
    """The options that have a value: `seconds` without unit, or a text with a unit."""
    given = {name: value for name, value in durations.items() if value is not None}
    texts = {name: value if isinstance(value, str) else f"{round(value * 1e6)}us" for name, value in given.items()}
    return [word for name, value in texts.items() for word in (f"--{name}", value)]


class Gauge:
    """A CAN bus with measuring devices.

    ``bus`` is the option ``--bus``: ``"can0"``, ``"sim"``, ``"slcan:/dev/ttyACM0@250k"`` … Without it, the only CAN
    interface that is up is used. ``options`` are global options: ``Gauge("can0", "--timeout", "1s")``.
    """

    def __init__(self, bus: Optional[str] = None, *options: str) -> None:
        self.bus = bus
        self.options = options
        #: If set, each command writes its frames to a file of this directory, and recordings stay there.
        self.artifacts: Optional[Path] = None
        #: The nodes that answered.
        self.nodes: set[int] = set()
        self._count = 0

    def run(self, *words: object) -> list[Row]:
        """Runs any command and returns its rows: ``gauge.run("unit", 127, "bar")``."""
        command = self._command(*words)
        none, pipe = subprocess.DEVNULL, subprocess.PIPE
        done = subprocess.run(command, stdin=none, stdout=pipe, stderr=pipe, encoding="utf-8", errors="replace")
        rows = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        self._finish(command, done.returncode, done.stderr, rows)
        return rows

    def scan(self, nodes: Nodes = "1-127", *options: str) -> list[Row]:
        """Returns the nodes that answer, with their state and identity."""
        return self.run("scan", _nodes(nodes), *options)

    def info(self, node: int) -> Row:
        """Returns everything about a device: identity, communication, errors, signals and their settings."""
        return self.run("info", node)[0]

    def read(self, node: int, signal: str, *options: str) -> Reading:
        """Reads one signal or object: ``read(5, "pressure")``, ``read(5, "pressure", "--in", "bar")``."""
        return self.readings(node, signal, *options)[0]

    def readings(self, nodes: Nodes, *signals: str) -> list[Reading]:
        """Reads all signals of the nodes, or only these."""
        rows = self.run("read", _nodes(nodes), *signals)
        return [Reading(*(row[field] for field in Reading._fields)) for row in rows]

    def get(self, node: int, object: str) -> Any:
        """Reads an object of the object dictionary: ``get(5, "0x1018:4")``."""
        return self.run("sdo", "read", node, object)[0]["value"]

    def write(self, node: int, object: str, value: object, *options: str) -> None:
        """Writes an object of the object dictionary, reads it back and compares."""
        self.run("sdo", "write", "--verify", *options, "--", node, object, value)

    def nmt(self, command: str, nodes: Nodes, *options: str) -> list[Row]:
        """Sends an NMT command (start, stop, preop, reset, reset-comm) or returns the states (state)."""
        return self.run("nmt", command, _nodes(nodes), *options)

    def check(
        self,
        nodes: Nodes,
        *expressions: str,
        seconds: Optional[Duration] = None,
        sync: Optional[Duration] = None,
        poll: Optional[Duration] = None,
    ) -> list[Row]:
        """Checks ``"pressure in 9.95..10.05 bar"`` and the like, with all samples of ``seconds`` or with one reading.

        Returns the verdicts. Raises CheckFailed if an expression is not satisfied.
        """
        return self.run("check", _nodes(nodes), *expressions, *_options(**{"for": seconds, "sync": sync, "poll": poll}))

    def log(
        self,
        nodes: Nodes,
        *signals: str,
        seconds: Optional[Duration] = None,
        count: Optional[int] = None,
        sync: Optional[Duration] = None,
        poll: Optional[Duration] = None,
        output: Optional[File] = None,
    ) -> Recording:
        """Records measured values while the body of ``with`` runs, or for ``seconds``, or until ``count`` rows exist.

        ``output`` keeps the rows in a file, as JSON Lines.
        """
        words = ["log", _nodes(nodes), *signals, *_options(duration=seconds, sync=sync, poll=poll)]
        words += [] if count is None else ["--count", str(count)]
        return Recording(self, words, output, has_end=seconds is not None or count is not None)

    def _command(self, *words: object) -> list[str]:
        self._count += 1
        bus = [] if self.bus is None else ["--bus", self.bus]
        keeps = self.artifacts is not None and "--trace" not in self.options
        trace = ["--trace", str(self._artifact(f"{words[0]}.log"))] if keeps else []
        return [program(), *bus, "--format", "json", *trace, *self.options, *map(str, words)]

    def _artifact(self, name: str) -> Path:
        return (self.artifacts or Path()) / f"{self._count:02}-{name}"

    def _finish(self, command: list[str], exit: int, text: str, rows: list[Row], is_stopped: bool = False) -> None:
        """Logs the notes of the program, and raises the error that it reports."""
        if self.artifacts is not None:
            with open(self.artifacts / "commands.txt", "a", encoding="utf-8") as file:
                file.write(f"{self._count:02} {subprocess.list2cmdline(command)}\n{text}exit code {exit}\n\n")
        errors = []
        for line in text.splitlines():
            if line.startswith('{"error":'):
                errors.append(json.loads(line)["error"])
            else:
                _log.log(logging.WARNING if line.startswith("warning: ") else logging.INFO, "%s", line)
        self.nodes.update(row["node"] for row in rows if isinstance(row.get("node"), int))
        if exit != 0 and not is_stopped:
            is_check = bool(errors) and errors[-1]["kind"] == "check-failed"
            raise (CheckFailed if is_check else GaugeError)(command, exit, errors, rows, text)


class Recording:
    """A running recording. After the body of ``with``, it has the rows."""

    def __init__(self, gauge: Gauge, words: list[str], output: Optional[File], has_end: bool) -> None:
        #: The rows: time, elapsed_s, node, signal, value, unit, status, raw.
        self.rows: list[Row] = []
        #: Statistics, gaps, losses: the option ``--summary``.
        self.summary: Row = {}
        self._gauge, self._words, self._output, self._has_end = gauge, words, output, has_end

    def __enter__(self) -> Recording:
        """Starts the recording and waits for its first rows."""
        gauge = self._gauge
        self._scratch = tempfile.TemporaryDirectory(prefix="cangauge-")
        self._command = gauge._command(*self._words)
        folder = Path(self._scratch.name) if gauge.artifacts is None else gauge.artifacts
        self._file = Path(self._output or folder / f"{gauge._count:02}-log.jsonl")
        self._summary = folder / f"{gauge._count:02}-summary.json"
        self._command += ["--output", str(self._file), "--summary", str(self._summary)]
        self._before = self._state()
        with open(Path(self._scratch.name) / "stderr", "wb") as stderr:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=stderr
            )
        try:
            # The program ends by itself if no values arrive within 5 s.
            while self._process.poll() is None and self._state() in (None, self._before):
                time.sleep(0.02)
        except BaseException:
            self._end(must_stop=True)
            raise
        if self._process.poll() not in (None, 0):
            self._end(must_stop=False)
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self._end(must_stop=kind is not None or not self._has_end, is_stopped=kind is not None)

    @property
    def data(self) -> Any:
        """The rows as a frame of pandas, or as a list if pandas is not installed."""
        try:
            pandas = importlib.import_module("pandas")
        except ImportError:
            return self.rows
        names = ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw"]
        frame = pandas.DataFrame(self.rows, columns=None if self.rows else names)
        if "time" in frame:
            frame["time"] = pandas.to_datetime(frame["time"])
        return frame

    def _state(self) -> Optional[tuple[int, int]]:
        """Size and time of the file; None if it has no rows."""
        found = self._file.stat() if self._file.exists() else None
        return (found.st_size, found.st_mtime_ns) if found and found.st_size else None

    def _end(self, must_stop: bool, is_stopped: bool = False) -> None:
        """Waits for the end of the program, which stops if `must_stop`. Its failure is ignored if `is_stopped`."""
        if must_stop and self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        exit = self._process.wait()
        text = (Path(self._scratch.name) / "stderr").read_text("utf-8", "replace")
        if self._state() not in (None, self._before):
            self.rows = [json.loads(line) for line in self._file.read_text("utf-8").splitlines()]
        if self._summary.exists():
            self.summary = json.loads(self._summary.read_text("utf-8"))
        self._scratch.cleanup()
        self._gauge._finish(self._command, exit, text, self.rows, is_stopped)
