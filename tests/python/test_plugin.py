"""The pytest plug-in: each test runs pytest on a test file."""

import xml.etree.ElementTree as xml

import pytest

ONE = "sim:mh4@5:pressure=1.25bar:temperature=20degC"


def outcome(pytester, text, *options, bus=ONE):
    pytester.makepyfile(test_bench=text)
    return pytester.runpytest_inprocess("-p", "no:randomly", *(["--cangauge-bus", bus] if bus else []), *options)


def test_failed_check_shows_the_line_of_its_verdict(pytester):
    done = outcome(pytester, """
        def test_limit(gauge):
            gauge.check(5, "pressure < 1 bar")
    """)  # fmt: skip
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines([
        '>       gauge.check(5, "pressure < 1 bar")',
        "E       cangauge.CheckFailed: FAIL  pressure < 1 bar: 1.25 bar",
        "FAILED test_bench.py::test_limit - cangauge.CheckFailed: FAIL  pressure < 1 b*",
    ])  # fmt: skip
    # The report ends at the line of the test.
    assert "__init__.py" not in done.stdout.str()


def test_failing_test_keeps_its_recording_and_trace(pytester):
    text = """
        def test_run(gauge):
            with gauge.log(5, "pressure", poll="10ms", count=3) as recording:
                pass
            assert gauge.read(5, "pressure").value == {value}
    """
    outcome(pytester, text.format(value=9)).assert_outcomes(failed=1)
    kept = pytester.path / ".cangauge" / "test_bench.py.test_run"
    names = ["01-log.jsonl", "01-log.log", "01-summary.json", "02-read.log", "commands.txt"]
    # Newer versions of log may write further files.
    assert set(names) <= {path.name for path in kept.iterdir()}
    assert (kept / "01-log.jsonl").read_text().count('"value":1.25') == 3
    assert " 605#40306101" in (kept / "02-read.log").read_text()
    commands = (kept / "commands.txt").read_text()
    assert " read 5 pressure\n" in commands and "exit code 0\n" in commands
    # The next run removes them.
    outcome(pytester, text.format(value=1.25)).assert_outcomes(passed=1)
    assert not kept.exists()
    # A test that passes leaves no files.
    assert not [*pytester.path.parent.glob("basetemp*/cangauge*")]


def test_artifacts_go_to_the_directory_of_the_option(pytester):
    done = outcome(pytester, """
        import pytest

        @pytest.mark.parametrize("limit", ["1 bar", "2 bar"])
        def test_limit(gauge, limit):
            gauge.check(5, f"pressure < {limit}")

        @pytest.mark.xfail
        def test_expected(gauge):
            gauge.check(5, "pressure < 1 bar")
    """, "--cangauge-artifacts", "kept/here")  # fmt: skip
    done.assert_outcomes(passed=1, failed=1, xfailed=1)
    [kept] = (pytester.path / "kept" / "here").iterdir()
    assert kept.name == "test_bench.py.test_limit-1-bar-"
    done.stdout.fnmatch_lines([f"recordings and traces: {kept}"])


def test_failure_in_a_fixture_keeps_artifacts(pytester):
    done = outcome(pytester, """
        import pytest

        @pytest.fixture
        def valve(gauge):
            gauge.read(5, "pressure")
            raise OSError

        def test_valve(valve):
            pass
    """)  # fmt: skip
    done.assert_outcomes(errors=1)
    assert (pytester.path / ".cangauge" / "test_bench.py.test_valve" / "01-read.log").exists()


def test_junit_report_has_version_bus_and_identities(pytester):
    outcome(pytester, """
        def test_one(gauge):
            gauge.read(5, "pressure")

        def test_none(gauge):
            pass
    """, "--junit-xml=report.xml").assert_outcomes(passed=2)  # fmt: skip
    one, none = xml.parse(pytester.path / "report.xml").iter("testcase")
    properties = {entry.get("name"): entry.get("value") for entry in one.iter("property")}
    assert properties.pop("cangauge.version")[0].isdigit()
    assert properties == {"cangauge.bus": ONE, "cangauge.node-5": "WIKA MH-4-CAN 71:1:1:10001"}
    assert len(list(none.iter("property"))) == 2


@pytest.mark.parametrize("option", [None, "sim:dps@7"])
def test_bus_of_the_environment(pytester, monkeypatch, option):
    monkeypatch.setenv("CANGAUGE_BUS", ONE)
    outcome(pytester, f"""
        def test_bus(gauge):
            assert gauge.bus == {option or ONE!r}
            assert [row["node"] for row in gauge.scan()] == [{7 if option else 5}]
    """, bus=option).assert_outcomes(passed=1)  # fmt: skip


def test_plugin_is_documented_in_the_help(pytester):
    pytester.runpytest_inprocess("--help").stdout.fnmatch_lines(["*--cangauge-bus=BUS*", "*--cangauge-artifacts=DIR*"])
