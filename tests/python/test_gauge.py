"""Values, errors and recordings."""

import logging
import os
import signal
import stat
import subprocess
import sys
import time

import pytest

import cangauge
from cangauge import CheckFailed, Gauge, GaugeError


def script(path, text):
    """Writes a program that replaces the real one."""
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def test_values_have_unit_and_status(constant):
    gauge = Gauge(constant)
    assert gauge.read(5, "pressure") == (5, "pressure", 1.25, "bar", "ok")
    assert gauge.read(127, "pressure").status is None
    assert gauge.read(127, "pressure", "--in", "bar").value == pytest.approx(3.44738, abs=1e-5)
    assert [(it.node, it.signal) for it in gauge.readings([5, 127])] == [
        (5, "pressure"), (5, "temperature"), (127, "pressure"),
    ]  # fmt: skip


def test_each_method_returns_the_rows_of_its_command(constant):
    gauge = Gauge(constant)
    assert [row["node"] for row in gauge.scan()] == [5, 127]
    assert [row["node"] for row in gauge.scan("1-16")] == [5]
    assert gauge.info(5)["identity"]["vendor"] == 71
    assert (gauge.get(5, "0x1018:1"), gauge.get(5, "0x1008")) == (71, "MH-4-CAN")
    assert gauge.write(5, "0x1017", 500) is None
    assert gauge.nmt("stop", 5) == [{"node": 5, "state": "stopped", "by": "sdo"}]
    assert gauge.run("unit", 127)[0]["unit"] == "psi"
    assert gauge.nodes == {5, 127}


def test_no_answer_is_an_error_with_node_object_and_hint(constant):
    with pytest.raises(GaugeError) as caught:
        Gauge(constant, "--timeout", "50ms").read(6, "pressure")
    error = caught.value
    assert (error.kind, error.exit, error.node, error.object) == ("no-answer", 3, 6, "0x1000:0")
    assert error.message == "node 6: read 0x1000:0: no answer within 50 ms"
    assert error.hint.endswith("cangauge doctor 6") and str(error) == f"{error.message}\nhint: {error.hint}"
    assert not isinstance(error, CheckFailed)


def test_refused_write_has_the_abort_code(constant):
    with pytest.raises(GaugeError) as caught:
        Gauge(constant).write(5, "0x1000", 1)
    assert (caught.value.kind, caught.value.exit, caught.value.abort) == ("refused", 4, "0x06010002")


def test_wrong_argument_is_a_usage_error(constant):
    with pytest.raises(GaugeError) as caught:
        Gauge(constant).read(200, "pressure")
    assert (caught.value.kind, caught.value.exit) == ("usage", 2)


def test_results_of_the_other_nodes_are_in_the_error(constant):
    with pytest.raises(GaugeError) as caught:
        Gauge(constant, "--timeout", "50ms").readings("5,6,7")
    error = caught.value
    assert (error.kind, error.exit) == ("partial", 7)
    assert {row["node"] for row in error.rows} == {5}
    assert [one["node"] for one in error.errors] == [6, 7]
    assert "node 6: " in error.message and "node 7: " in error.message


def test_failure_without_a_report_shows_the_text(tmp_path, monkeypatch):
    monkeypatch.setenv("CANGAUGE", script(tmp_path / "broken", "echo no such library >&2; exit 127"))
    with pytest.raises(GaugeError, match="no such library") as caught:
        Gauge("sim").scan()
    assert (caught.value.kind, caught.value.exit) == ("unknown", 127)


def test_notes_and_warnings_are_logged(constant, caplog):
    caplog.set_level(logging.INFO, "cangauge")
    gauge = Gauge(constant)
    gauge.check(5, "pressure < 2")
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    gauge.nmt("start", 5)
    assert "node 5: command sent, not confirmed" in caplog.text


def test_check_returns_the_verdicts(constant):
    verdicts = Gauge(constant).check(5, "pressure in 1..2 bar", "temperature < 60 degC")
    assert [verdict["verdict"] for verdict in verdicts] == ["ok", "ok"]
    verdicts = Gauge(constant).check(5, "noise(pressure) < 0.01 bar", seconds=0.2, sync=0.02)
    assert verdicts[0]["count"] == 10


def test_failed_check_has_one_line_for_each_failed_expression(constant):
    with pytest.raises(CheckFailed) as caught:
        Gauge(constant).check(5, "pressure < 1 bar", "pressure < 2 bar", "temperature > 20 degC")
    assert str(caught.value) == "FAIL  pressure < 1 bar: 1.25 bar\nFAIL  temperature > 20 degC: 20 degC"
    assert isinstance(caught.value, AssertionError) and len(caught.value.rows) == 3
    with pytest.raises(CheckFailed) as caught:
        Gauge(constant).check([5, 127], "pressure < 2 bar")
    assert str(caught.value).startswith("FAIL  node 127: pressure < 2 bar: 3.44")


def test_check_without_data_is_no_failed_check(constant):
    with pytest.raises(GaugeError) as caught:
        Gauge(constant).check(5, "pressure < 2 bar", seconds="100ms")
    assert not isinstance(caught.value, CheckFailed) and caught.value.exit == 3
    assert "TPDO1 waits for SYNC" in caught.value.message


def test_recording_covers_the_body(constant, tmp_path):
    gauge = Gauge(constant)
    with gauge.log([5, 127], "pressure", sync="10ms", output=tmp_path / "run.jsonl") as recording:
        size = (tmp_path / "run.jsonl").stat().st_size
        assert size > 0 and recording.rows == []
        while (tmp_path / "run.jsonl").stat().st_size == size:
            time.sleep(0.01)
    assert {(row["node"], row["value"], row["unit"]) for row in recording.rows} == {(5, 1.25, "bar"), (127, 50, "psi")}
    assert recording.summary["complete"] and recording.summary["rows"] == len(recording.rows) > 10
    assert gauge.nodes == {5, 127}


def test_recording_with_an_end_is_complete(constant):
    with Gauge(constant).log(5, "pressure", poll=0.01, count=80) as recording:
        pass
    assert len(recording.rows) == 80 and recording.summary["complete"]


def test_recording_that_cannot_start_raises(constant):
    with pytest.raises(GaugeError) as caught:
        with Gauge(constant).log(5, seconds=0.1):
            pytest.fail("the body ran")
    assert "TPDO1 waits for SYNC" in caught.value.message


def test_recording_does_not_replace_a_file(constant, tmp_path):
    (tmp_path / "run.jsonl").write_text("old\n")
    with pytest.raises(GaugeError) as caught:
        with Gauge(constant).log(5, poll="10ms", output=tmp_path / "run.jsonl"):
            pytest.fail("the body ran")
    assert caught.value.exit == 2 and (tmp_path / "run.jsonl").read_text() == "old\n"


def test_error_of_the_body_stops_the_recording(constant, tmp_path):
    with pytest.raises(ZeroDivisionError):
        with Gauge(constant).log(5, poll="10ms", seconds=60, output=tmp_path / "run.jsonl") as recording:
            1 / 0
    assert recording.rows and not recording.summary["complete"]


def test_recording_that_was_killed_raises(constant, tmp_path):
    with pytest.raises(GaugeError) as caught:
        with Gauge(constant).log(5, poll="10ms", output=tmp_path / "run.jsonl") as recording:
            recording._process.send_signal(signal.SIGKILL)
    assert caught.value.exit == -signal.SIGKILL


def test_data_is_a_frame_if_pandas_is_installed(constant):
    pandas = pytest.importorskip("pandas", reason="SKIPPED: pandas is not installed")
    with Gauge(constant).log(5, "pressure", poll="10ms", count=3) as recording:
        pass
    frame = recording.data
    assert list(frame.columns) == ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw"]
    assert pandas.api.types.is_datetime64_any_dtype(frame["time"]) and frame["value"].mean() == 1.25
    # A recording that was not started is empty.
    assert list(Gauge(constant).log(5).data.columns) == list(frame.columns)


def test_data_is_a_list_without_pandas(constant, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with Gauge(constant).log(5, "pressure", poll="10ms", count=3) as recording:
        pass
    assert recording.data is recording.rows and len(recording.data) == 3


def test_program_is_searched_beside_python_before_the_path(tmp_path, monkeypatch):
    monkeypatch.delenv("CANGAUGE", raising=False)
    for folder in ("venv", "path"):
        (tmp_path / folder).mkdir()
        script(tmp_path / folder / "cangauge", "exit 0")
    monkeypatch.setattr(cangauge.sysconfig, "get_path", lambda *_: str(tmp_path / "none"))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "venv" / "python"))
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    assert cangauge.program() == str(tmp_path / "venv" / "cangauge")
    os.remove(tmp_path / "venv" / "cangauge")
    assert cangauge.program() == str(tmp_path / "path" / "cangauge")
    os.remove(tmp_path / "path" / "cangauge")
    with pytest.raises(FileNotFoundError, match="CANGAUGE"):
        cangauge.program()
    monkeypatch.setenv("CANGAUGE", "/elsewhere/cangauge")
    assert cangauge.program() == "/elsewhere/cangauge"


def test_version_is_that_of_the_project(documents):
    version = subprocess.run([cangauge.program(), "--version"], capture_output=True, text=True).stdout.split()[1]
    assert f'\nversion = "{version}"\n' in (documents / "Cargo.toml").read_text()
