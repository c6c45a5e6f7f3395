"""`log` with python-canopen and simulated devices: each row is compared with the record of the device."""

import datetime
import json
import os
import signal

from harness import PATIENT, begins, devices, measured, rows_of, wait_for

ALL = ("10:real32", "11:integer", "12:overload")
SIMULATED = (("mh4", 1), ("d20", 2), ("mc1609", 3), ("dps", 127))


def check_times(rows, started, ended):
    """Checks that `time` and `elapsed_s` increase, agree, and lie within the run."""
    times = [datetime.datetime.fromisoformat(row["time"]) for row in rows]
    elapsed = [float(row["elapsed_s"]) for row in rows]
    assert times == sorted(times) and elapsed == sorted(elapsed) and elapsed[0] == 0
    assert started <= times[0] and times[-1] <= ended, (started, times[0], times[-1], ended)
    for time, seconds in zip(times, elapsed):
        # The clocks are read one after the other: one millisecond tolerance.
        assert abs((time - times[0]).total_seconds() - seconds) < 0.05, (time, seconds)


def now():
    return datetime.datetime.now(datetime.timezone.utc)


def as_sent(cangauge, directory):
    """Event timer: all TPDOs from the first one after the start, for three kinds of devices."""
    with devices(cangauge.interface, directory, *ALL, heartbeat=100) as record:
        started = now()
        result = cangauge.run("log", "10-12", "--count", 90)
        check_times(result.rows(), started, now())
        rows = measured(result.rows())
        assert len(rows) == 90
        for node in (10, 11, 12):
            begins([row for row in rows if row[0] == str(node)], record(node))
        assert "0 frames dropped" in result.err, result
        # Their states were known, so they were restored.
        states = cangauge.run("--timeout", "2s", "nmt", "state", "10-12", "--format", "json").json()
        assert [state["state"] for state in states] == ["pre-operational"] * 3, states


def into_a_file(cangauge, directory):
    """-o, JSON Lines, the summary, one node of several, Ctrl-C."""
    path, summary = os.path.join(directory, "run.csv"), os.path.join(directory, "summary.json")
    with devices(cangauge.interface, directory, *ALL, heartbeat=100) as record:
        with cangauge.running("log", "12", "-o", path, "--summary", summary, directory=directory) as log:
            wait_for(lambda: os.path.exists(path) and open(path).read().count("\n") > 40, lambda: log.text("err"), log.process)
            result = log.finish()
        assert result.out == "", result
        with open(path, encoding="ascii") as file:
            text = file.read()
        rows = measured(rows_of(text))
        assert text.endswith("\n") and text.count("\n") == len(rows) + 1
        begins(rows, record(12))
        with open(summary, encoding="ascii") as file:
            totals = json.load(file)
        signals = totals["signals"]
        values = [float(row[2]) for row in rows if row[2]]
        assert totals["rows"] == len(rows) and totals["dropped"] == 0 and totals["lost_nodes"] == [], totals
        assert [(s["node"], s["signal"], s["unit"], s["count"], s["invalid"], s["min"], s["max"]) for s in signals] == \
            [(12, "ch1", "bar", len(rows), len(rows) - len(values), min(values), max(values))], totals
        assert abs(signals[0]["mean"] - sum(values) / len(values)) < 1e-9, totals
        # An existing file is not overwritten.
        cangauge.run("log", "12", "-o", path, "--count", 1, exit=2)
        assert open(path).read() == text
    with devices(cangauge.interface, directory, *ALL) as record:
        lines = cangauge.run("log", "11,12", "--count", 40, "--format", "json").json()
        text = [tuple("" if line[name] is None else str(line[name]) for name in ("node", "signal", "unit", "status", "raw"))
                for line in lines]
        for node in (11, 12):
            sent = record(node)
            begins([row for row in text if row[0] == str(node)], [(n, s, u, status, raw) for n, s, _, u, status, raw in sent])
            values = [line["value"] for line in lines if line["node"] == node]
            assert values == [float(row[2]) if row[2] else None for row in sent][: len(values)]


def on_sync(cangauge, directory):
    """--sync: one row for each SYNC and node, and TPDOs at every third SYNC."""
    with devices(cangauge.interface, directory, *ALL, sync=1) as record:
        result = cangauge.run("log", "10-12", "--sync", "20ms", "--count", 90)
        rows = measured(result.rows())
        begins(rows, record())
        assert len(rows) == 90
        # Without SYNC, no TPDO is sent, and the message contains the reason.
        silent = cangauge.run("log", 10, "--duration", "500ms", exit=3)
        assert silent.out == "" and "SYNC" in silent.err and "--sync" in silent.err, silent
    with devices(cangauge.interface, directory, *ALL, sync=3) as record:
        rows = measured(cangauge.run("log", "10-12", "--sync", "10ms", "--count", 30).rows())
        begins(rows, record())


def by_polling(cangauge, directory):
    """--poll: the same value each time in PRE-OPERATIONAL; rising values while TPDOs increment it."""
    with devices(cangauge.interface, directory, "10:real32", "11:integer") as record:
        rows = measured(cangauge.run(*PATIENT, "log", "10,11", "--poll", "30ms", "--count", 20).rows())
        assert {row[:5] for row in rows} == {("10", "ch1", "-100", "bar", "ok"), ("11", "ch1", "-5", "psi", "ok")}, rows
        assert record() == [], "polling started a node"
        cangauge.run("nmt", "start", 10, "--no-wait")
        rows = measured(cangauge.run(*PATIENT, "log", "10", "ch1", "--poll", "30ms", "--count", 40).rows())
        sent = record(10)
        values = [float(row[2]) for row in rows]
        assert values == sorted(values) and values[0] < values[-1], values
        # The answer is the value of the next TPDO.
        assert set(rows) <= set(sent[1:]) | {rows[-1]}, (rows, sent)


def ends(cangauge, directory):
    """SIGTERM and a closed pipe end a recording normally; a node that stops sending is named."""
    with devices(cangauge.interface, directory, *ALL) as record:
        with cangauge.running("log", "10", directory=directory) as log:
            log.await_rows(5)
            begins(measured(log.finish(end=signal.SIGTERM).rows()), record(10))
    with devices(cangauge.interface, directory, "10:real32") as record:
        with devices(cangauge.interface, directory, "11:integer"):
            log = cangauge.running("log", "10,11", directory=directory)
            recording = log.__enter__()
            recording.await_rows(10)
        try:
            recording.await_words("node 11: silent")
            result = recording.finish(exit=7)
        finally:
            log.__exit__(None, None, None)
        assert "node 11 lost" in result.err, result
        begins(measured(result.rows(), 10), record(10))


def simulated_devices(cangauge, directory):
    """All four simulated devices in another process: TPDOs at SYNC if configured so, and overloads with their
    status."""
    record = os.path.join(directory, "truth.csv")
    bench = write_bench(directory, record)
    with cangauge.simulator(bench, directory) as simulator:
        cangauge.run("scan", "1-3,127", "--timeout", "5s")
        result = cangauge.run("log", "1-3,127", "--sync", "10ms", "--count", 4000)
        simulator.finish()
    rows = measured(result.rows())
    assert len(rows) == 4000
    with open(record, encoding="ascii") as file:
        sent = measured(rows_of(file.read()))
    begins(rows, sent)
    assert {row[4] for row in rows} >= {"", "ok", "overload-high", "overload-low"}, {row[4] for row in rows}
    assert {row[3] for row in rows} == {"bar", "degC", "psi"}


def write_bench(directory, record):
    """All four devices; the pressure of the first leaves its range repeatedly."""
    path = os.path.join(directory, "bench.toml")
    with open(path, "w", encoding="ascii") as file:
        file.write(f'record = "{record}"\nseed = 5\n')
        for kind, node in SIMULATED:
            file.write(f'[[device]]\nkind = "{kind}"\nnode = {node}\n')
            if kind == "mh4":
                for second in range(1, 100):
                    direction = "low" if second % 2 else "high"
                    file.write(f'[[device.overload]]\nchannel = 1\nfrom = "{second}s"\nuntil = "{second * 1000 + 200}ms"\n'
                               f'direction = "{direction}"\n')
    return path


CHECKS = [as_sent, into_a_file, on_sync, by_polling, ends, simulated_devices]
