"""pandas reads the files of `log` without options: numbers as numbers, missing values as NaN, and a plot.

    tables.py PROGRAM
"""

import csv
import os
import subprocess
import sys
import tempfile

import matplotlib
import pandas

BENCH = """
clock = "virtual"
[[device]]
kind = "mh4"
node = 5
[[device.overload]]
channel = 1
from = "700ms"
until = "800ms"
direction = "high"
[[device]]
kind = "dps"
node = 127
"""


def is_text(column):
    return pandas.api.types.is_string_dtype(column)


def is_number(column):
    return pandas.api.types.is_float_dtype(column) or pandas.api.types.is_integer_dtype(column)


def check_long(table, cells):
    assert list(table.columns) == ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw"]
    assert len(table) == len(cells) > 100
    assert table["elapsed_s"].dtype == "float64" and table["value"].dtype == "float64", table.dtypes
    assert table["node"].dtype == "int64", table.dtypes
    assert all(is_text(table[name]) for name in ("signal", "unit", "status", "raw")), table.dtypes
    overloaded = table["status"] == "overload-high"
    assert overloaded.sum() == 10 and table["value"][overloaded].isna().all() and table["value"].isna().sum() == 10
    assert (table["node"][table["status"].isna()] == 127).all(), "the DPS sends no status"
    for cell, value in zip(cells, table["value"]):
        assert cell["value"] == "" or float(cell["value"]) == value
    times = pandas.to_datetime(table["time"])
    assert str(times.dtype).endswith("UTC]") and times.is_monotonic_increasing, times.dtype
    apart = (times - times[0]).dt.total_seconds() - table["elapsed_s"]
    assert apart.abs().max() < 1e-6, "both columns agree"


def check_wide(table):
    pressure = table["5.pressure [bar]"]
    assert pressure.dtype == "float64" and table["127.pressure [psi]"].dtype == "float64", table.dtypes
    assert pressure.isna().sum() == 10 and (table["5.pressure.status"] == "overload-high").sum() == 10
    assert table["127.pressure [psi]"].notna().sum() in range(5, 12)
    assert (table["elapsed_s"].diff()[1:] - 0.01).abs().max() < 0.005


def plot(table, path):
    matplotlib.use("svg")
    axes = table.plot(x="elapsed_s", y=["5.pressure [bar]", "127.pressure [psi]"], style=".-")
    drawn = {line.get_label(): len(line.get_xdata()) for line in axes.get_lines()}
    assert drawn == {"5.pressure [bar]": len(table), "127.pressure [psi]": len(table)}, drawn
    axes.figure.savefig(path)
    assert os.path.getsize(path) > 1000


def main():
    program = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as directory:
        path = lambda name: os.path.join(directory, name)
        with open(path("bench.toml"), "w", encoding="ascii") as file:
            file.write(BENCH)

        def log(name, *options):
            words = ["--bus", "sim:bench.toml", "log", "5,127", "pressure", "--sync", "10ms", "--duration", "1s"]
            subprocess.run([program, *words, "-q", "-o", name, *options], cwd=directory, check=True)
            return path(name)

        file = log("long.csv")
        with open(file, encoding="ascii", newline="") as text:
            check_long(pandas.read_csv(file), list(csv.DictReader(text)))
        table = pandas.read_csv(log("wide.csv", "--layout", "wide"))
        check_wide(table)
        plot(table, path("plot.svg"))
        same = pandas.read_json(log("wide.json", "--layout", "wide", "--format", "json"), lines=True)
        assert list(same.columns) == list(table.columns) and same.shape == table.shape
        # By default pandas rounds numbers in JSON; precise_float reads them exactly.
        apart = same["5.pressure [bar]"].fillna(-1) - table["5.pressure [bar]"].fillna(-1)
        assert apart.abs().max() < 1e-12, apart
        german = log("german.csv", "--layout", "wide", "--delimiter", ";", "--decimal", ",", "--bom")
        same = pandas.read_csv(german, sep=";", decimal=",")
        assert list(same.columns) == list(table.columns), "the first column name contains the byte order mark"
        assert (same.dtypes == table.dtypes).all(), same.dtypes
    print("pandas reads and draws what log writes")


if __name__ == "__main__":
    main()
