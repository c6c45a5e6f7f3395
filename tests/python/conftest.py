"""Tests of the Python package and of its pytest plug-in.

    PYTHONPATH=src/python PYTEST_PLUGINS=cangauge.pytest_plugin CANGAUGE=target/debug/cangauge pytest tests/python

With an installed wheel, the variables are not needed.
"""

import os
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

# Tests change the working directory.
for name in ("CANGAUGE", "PYTHONPATH"):
    if name in os.environ:
        os.environ[name] = os.path.abspath(os.environ[name])


@pytest.fixture
def constant():
    """Two sensors with constant values."""
    return "sim:mh4@5:pressure=1.25bar:temperature=20degC,dps@127:pressure=50psi"


@pytest.fixture
def documents():
    """The directory of the project."""
    return Path(__file__).resolve().parents[2]
