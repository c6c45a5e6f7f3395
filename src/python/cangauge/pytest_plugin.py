"""The pytest plug-in: the fixture ``gauge``, artefacts of failing tests, and properties in the JUnit report."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Callable, Generator, Iterator

import pluggy
import pytest

from cangauge import Gauge, GaugeError, program

# The fixture, and the directory for its artefacts if the test fails.
_KEY = pytest.StashKey[tuple[Gauge, Path]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the options of the plug-in."""
    group = parser.getgroup("cangauge", "CANopen measuring devices")
    bus = "bus of the fixture gauge: can0, sim ... [default: CANGAUGE_BUS, else the only CAN interface that is up]"
    group.addoption("--cangauge-bus", metavar="BUS", default=os.environ.get("CANGAUGE_BUS"), help=bus)
    kept = "directory for recordings and traces of failing tests [default: .cangauge]"
    group.addoption("--cangauge-artifacts", metavar="DIR", default=".cangauge", help=kept)


@pytest.fixture
def gauge(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    record_property: Callable[[str, object], None],
) -> Iterator[Gauge]:
    """A Gauge on the bus of ``--cangauge-bus``. Its recordings and traces are kept if the test fails."""
    config = request.config
    gauge = Gauge(config.getoption("--cangauge-bus"))
    gauge.artifacts = tmp_path_factory.mktemp("cangauge")
    kept = config.rootpath / config.getoption("--cangauge-artifacts") / _file_name(request.node.nodeid)
    # Artefacts of an earlier run would be misleading.
    shutil.rmtree(kept, ignore_errors=True)
    request.node.stash[_KEY] = gauge, kept
    version = subprocess.run([program(), "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout
    record_property("cangauge.version", version.split()[-1])
    record_property("cangauge.bus", gauge.bus or "default")
    yield gauge
    if config.getoption("xmlpath", None):
        for node, identity in _identities(gauge):
            record_property(f"cangauge.node-{node}", identity)
    shutil.rmtree(gauge.artifacts, ignore_errors=True)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pluggy.Result[pytest.TestReport], None]:
    """Keeps the artefacts of a failing test."""
    report = (yield).get_result()
    gauge, kept = item.stash.get(_KEY, (None, None))
    if report.failed and gauge and kept and gauge.artifacts and gauge.artifacts.exists():
        shutil.copytree(gauge.artifacts, kept, dirs_exist_ok=True)
        report.sections.append(("cangauge", f"recordings and traces: {kept}"))


def _file_name(test: str) -> str:
    """A name for a directory that every file system accepts: `tests.test_a.py.test_zero-127-`."""
    return re.sub(r"[^\w.-]+", "-", test.replace("::", ".").replace("/", "."))[-120:]


def _identities(gauge: Gauge) -> Iterator[tuple[int, str]]:
    """The identities of the nodes that answered during the test. Nodes without an answer now are left out."""
    if not gauge.nodes:
        return
    try:
        rows = gauge.scan(sorted(gauge.nodes))
    except GaugeError as error:
        rows = error.rows
    for row in rows:
        names = f"{row['vendor_name'] or ''} {row['name'] or row['device'] or ''}".strip()
        numbers = ":".join(str(row[field]) for field in ("vendor", "product", "revision", "serial"))
        yield row["node"], f"{names} {numbers}".strip()
