"""The Python examples of the documents work. CANGAUGE_TEST_BUS (sim) is a bus with the devices of `-b sim`."""

import os
import re
import subprocess
import sys

import pytest

BUS = os.environ.get("CANGAUGE_TEST_BUS", "sim")


def blocks(path, language="python"):
    return re.findall(rf"^```{language}\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(("document", "at"), [("README.md", 0), ("src/python/README.md", 0)])
def test_script_works(documents, document, at):
    text = blocks(documents / document)[at]
    assert 'Gauge("sim")' in text
    text = text.replace('Gauge("sim")', f'Gauge("{BUS}")')
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert " bar" in done.stdout, done.stdout
    if document == "src/python/README.md":
        assert done.stdout.startswith("1 mh4 ") and "\nno-answer 3 5 0x1000:0 check " in done.stdout, done.stdout


def test_tests_of_the_document_pass(documents, pytester):
    [text] = [block for block in blocks(documents / "src/python/README.md") if "def test_" in block]
    pytester.makepyfile(test_document=text)
    pytester.runpytest_inprocess("--cangauge-bus", BUS).assert_outcomes(passed=3)


def test_options_of_the_document_exist(documents, pytester):
    [command] = blocks(documents / "src/python/README.md", "sh")
    shown = pytester.runpytest_inprocess("--help").stdout.str()
    options = set(re.findall(r"--[\w-]+", command))
    assert {"--cangauge-bus", "--junit-xml"} <= options and all(option in shown for option in options)
