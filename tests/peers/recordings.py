"""Recordings that python-can writes are replayed with the same frames at the same times. Formats that are not read are
refused with a command that converts them. tshark, if it is installed, reads the capture of `--trace`. With the DBC of
`export`, cantools decodes a trace to the values of `log`.

    recordings.py PROGRAM
"""

import csv
import io
import logging
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile

import can
import cantools

START = 1_700_000_000
TEXT = ("log", "asc", "trc", "csv")


def messages():
    """Frames of all kinds."""
    chance = random.Random(7)
    for number in range(300):
        kind = chance.choice(("standard", "standard", "extended", "remote", "error"))
        length = chance.randrange(9)
        yield can.Message(
            timestamp=START + number / 100 + chance.randrange(9999) / 1e6,
            arbitration_id=chance.randrange(0x20000000 if kind == "extended" else 0x800),
            is_extended_id=kind == "extended",
            is_remote_frame=kind == "remote",
            is_error_frame=kind == "error",
            dlc=length,
            data=b"" if kind in ("remote", "error") else chance.randbytes(length),
            channel=0,
        )


def shown(message, has_remote_length):
    """A frame as `candump -L` shows it. In its logs, python-can writes remote frames without their length."""
    name = f"{message.arbitration_id:0{8 if message.is_extended_id else 3}X}"
    if message.is_remote_frame:
        return f"{name}#R{message.dlc or ''}" if has_remote_length else f"{name}#R"
    return f"{name}#{message.data.hex().upper()}"


def write(path, frames):
    with can.Logger(path) as logger:
        for message in frames:
            logger(message)


def traced(program, file, trace):
    """The times and frames that a replay delivers."""
    words = [program, "-q", "-b", f"replay:{file}", "--trace", trace, "scan", "--passive"]
    subprocess.run(words, env={"TZ": "UTC0"}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
    with open(trace, encoding="ascii") as lines:
        found = [re.fullmatch(r"\((\d+\.\d+)\) \S+ (\S+)\n", line).groups() for line in lines]
    return [(float(time), frame) for time, frame in found]


def compare(name, found, expected, tolerance):
    shown_here = [shown(message, ".log" not in name) for message in expected]
    assert [frame for _, frame in found] == shown_here, name
    for (time, _), message in zip(found, expected):
        assert abs(time - message.timestamp) < tolerance, (name, time, message)


def check_text(program, path, frames):
    expected = [message for message in frames if not message.is_error_frame]
    # python-can writes only data frames into a TRC, and the date of an ASC without microseconds.
    data = [message for message in expected if not message.is_remote_frame]
    for name in [*TEXT, *(f"{name}.gz" for name in TEXT)]:
        write(path(f"run.{name}"), frames)
        found = traced(program, path(f"run.{name}"), path("trace.log"))
        compare(f"run.{name}", found, data if "trc" in name else expected, 0.001 if "asc" in name else 2e-6)


def check_converted(program, path, frames):
    expected = [message for message in frames if not message.is_error_frame]
    for name in ("blf", "db"):
        write(path(f"run.{name}"), frames)
        words = [program, "-b", f"replay:run.{name}", "scan", "--passive"]
        refused = subprocess.run(words, cwd=path(""), capture_output=True, text=True, check=False)
        assert refused.returncode == 8, refused
        command = re.search(r"^hint: .*: python3 (-m can.logconvert \S+ (\S+))$", refused.stderr, re.MULTILINE)
        subprocess.run([sys.executable, *command[1].split()], cwd=path(""), check=True)
        found = traced(program, path(command[2]), path("trace.log"))
        compare(command[2], found, expected, 2e-6)


def check_capture(program, path, frames):
    if not shutil.which("tshark"):
        print("SKIPPED: tshark is not installed")
        return
    words = [program, "-q", "-b", f"replay:{path('run.csv')}", "--trace", path("run.pcapng"), "scan", "--passive"]
    subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    names = ("frame.time_epoch", "can.id", "can.flags.xtd", "can.flags.rtr", "can.len")
    fields = [word for name in (*names, "data") for word in ("-e", name)]
    tshark = ["tshark", "-r", path("run.pcapng"), "-T", "fields", "-E", "separator=,", *fields]
    lines = subprocess.run(tshark, capture_output=True, text=True, check=True).stdout.splitlines()
    expected = [message for message in frames if not message.is_error_frame]
    assert len(lines) == len(expected), (len(lines), len(expected))
    for line, message in zip(lines, expected):
        time, number, extended, remote, length, data = line.split(",")
        assert abs(float(time) - message.timestamp) < 2e-6, (line, message)
        assert int(number, 0) == message.arbitration_id and int(length) == message.dlc, (line, message)
        assert extended in (str(int(message.is_extended_id)), str(message.is_extended_id)), (line, message)
        assert remote in (str(int(message.is_remote_frame)), str(message.is_remote_frame)), (line, message)
        assert data == message.data.hex(), (line, message)
    # The command in the hint keeps the data frames of 11 bits, as CANopen uses them.
    words = [program, "-b", "replay:run.pcapng", "scan", "--passive"]
    refused = subprocess.run(words, cwd=path(""), capture_output=True, text=True, check=False)
    command = re.search(r"^hint: convert it: (.* > (\S+))$", refused.stderr, re.MULTILINE)
    subprocess.run(command[1], cwd=path(""), shell=True, stderr=subprocess.DEVNULL, check=True)
    found = traced(program, path(command[2]), path("trace.log"))
    compare(command[2], found, [it for it in expected if not it.is_extended_id and not it.is_remote_frame], 2e-6)


def check_dbc(program, path):
    run = lambda *words: subprocess.run(
        [program, "-q", "-b", "sim:bench.toml", *words], cwd=path(""), capture_output=True, text=True, check=True
    ).stdout
    with open(path("bench.toml"), "w", encoding="ascii") as bench:
        bench.write('clock = "virtual"\n')
        for node, kind in enumerate(("mh4", "d20", "mc1609", "dps"), 1):
            bench.write(f'[[device]]\nkind = "{kind}"\nnode = {node}\n')
    dbc = cantools.database.load_string(run("export", "dbc", "all"), "dbc")
    text = run("log", "all", "--sync", "10ms", "--count", "500", "--trace", path("trace.log"))
    rows = list(csv.DictReader(io.StringIO(text)))
    values, known = [], {message.frame_id for message in dbc.messages}
    for message in can.LogReader(path("trace.log")):
        if message.arbitration_id in known and not message.is_remote_frame:
            signals = dbc.get_message_by_frame_id(message.arbitration_id).signals
            decoded = dbc.decode_message(message.arbitration_id, message.data)
            values += [(it.name, decoded[it.name], it.unit) for it in signals if not it.name.endswith("_status")]
    assert len(rows) == 500 and {row["node"] for row in rows} == set("1234")
    for row, (name, value, unit) in zip(rows, values):
        assert (row["signal"], row["unit"]) == (name, unit), (row, name, unit)
        assert abs(float(row["value"]) - value) < 1e-6 * max(1, abs(value)), (row, value)


def main():
    program = os.path.abspath(sys.argv[1])
    os.environ["TZ"] = "UTC0"
    # It warns of every frame that it does not write.
    logging.disable()
    frames = list(messages())
    with tempfile.TemporaryDirectory() as directory:
        path = lambda name: os.path.join(directory, name)
        check_text(program, path, frames)
        check_converted(program, path, frames)
        check_capture(program, path, frames)
        check_dbc(program, path)
    print("recordings of python-can are replayed; tshark and cantools read a trace")


if __name__ == "__main__":
    main()
