"""Checks the two peers against each other: master.py must read the values of device.py.

    check.py IFACE

This separates faults of the peers from faults of cangauge.
"""

import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))


def run(interface, sync):
    """Reads one pair of devices with the master. Returns the answers and the record of sent TPDOs."""
    with tempfile.TemporaryDirectory() as directory:
        record = os.path.join(directory, "record.csv")
        command = [sys.executable, os.path.join(HERE, "device.py"), "--record", record, "--heartbeat", "200"]
        command += ["--sync", str(sync)] if sync else ["--period", "20"]
        device = subprocess.Popen(command + [interface, "10:real32", "11:integer"], stdout=subprocess.PIPE, text=True)
        try:
            assert device.stdout.readline() == "ready\n"
            command = [sys.executable, os.path.join(HERE, "master.py")] + (["--sync"] if sync else [])
            answers = subprocess.run(command + [interface, "10", "11"], stdout=subprocess.PIPE, text=True, check=True)
        finally:
            device.terminate()
            status = device.wait(10)
        assert status == 0, f"device.py: exit status {status}"
        with open(record, encoding="ascii") as file:
            sent = [line.strip().split(",") for line in file]
    return [json.loads(line) for line in answers.stdout.splitlines()], sent


def check(answer, sent, expected, sync):
    """Compares one answer with the known device."""
    tpdos = answer.pop("tpdos")
    inputs = answer.pop("inputs")
    node = answer["node"]
    assert answer == {
        "node": node, "device_type": 0x00020194, "identity": [0x1234, expected["product"], 0x00020004, 1000 + node],
        "name": expected["name"], "states": ["PRE-OPERATIONAL", "OPERATIONAL", "PRE-OPERATIONAL"],
    }, answer
    assert inputs["6131"] == [expected["unit"]] and inputs["6132"] == [expected["digits"]], inputs
    assert inputs["6130"] == [expected["first"]], inputs
    assert len(tpdos) == 1, tpdos
    tpdo = tpdos[0]
    assert tpdo["mapping"] == expected["mapping"] and tpdo["cob_id"] == 0x180 + node, tpdo
    assert tpdo["transmission"] == (sync or 254), tpdo
    record = [float(value) for number, _, value, _ in sent if int(number) == node]
    values = [value for value, *_ in tpdo["values"]]
    assert len(values) == 3 and values[0] < values[1] < values[2], values
    assert set(values) <= set(record), (values, record)
    if sync:
        assert values == record, (values, record)
    assert record == [expected["value"](n) for n in range(len(record))], record


def main():
    interface = sys.argv[1]
    expected = {
        10: {"name": "python-canopen pressure transmitter", "product": 1, "unit": 0x004E0000, "digits": 2, "first": -100,
             "mapping": ["6130:1/32", "6150:1/8"], "value": lambda n: n / 4 - 100},
        11: {"name": "python-canopen pressure switch", "product": 2, "unit": 0x00AB0000, "digits": 3, "first": -5,
             "mapping": ["9130:1/32"], "value": lambda n: 7 * n - 5000},
    }
    for sync in (0, 1, 3):
        answers, sent = run(interface, sync)
        assert [answer["node"] for answer in answers] == [10, 11], answers
        for answer in answers:
            check(answer, sent, expected[answer["node"]], sync)
        print(f"peers agree: {'every %d. SYNC' % sync if sync else 'event timer'}, {len(sent)} TPDOs", flush=True)


if __name__ == "__main__":
    main()
