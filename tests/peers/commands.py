"""scan, sdo, nmt and read with python-canopen devices."""

import json
import os
import struct
import subprocess
import sys

from harness import GIVE_UP, HERE, PATIENT, devices, expected, wait_for

PAIR = ("10:real32", "11:integer")
# No device has this node-ID.
ABSENT = 77


def found(node):
    """The expected result of `scan` for one of the PAIR, without the state."""
    product, name = {10: (1, "python-canopen pressure transmitter"), 11: (2, "python-canopen pressure switch")}[node]
    return {"node": node, "device_type": "0x00020194", "profile": 404, "vendor": 0x1234, "vendor_name": None,
            "product": product, "revision": 0x20004, "serial": 1000 + node, "name": name, "device": None}


def scan(cangauge, directory):
    with devices(cangauge.interface, directory, *PAIR, heartbeat=100):
        nodes = cangauge.run("scan", "--format", "json", "--timeout", "2s").json()
        states = [node.pop("state") for node in nodes]
        assert nodes == [found(10), found(11)], nodes
        # Twenty heartbeats arrive in two seconds.
        assert states == ["pre-operational"] * 2, states
        lines = cangauge.run("scan", "--timeout", "2s").out.splitlines()
        assert lines[0].split() == ["NODE", "STATE", "DEVICE", "NAME", "VENDOR", "PRODUCT", "REVISION", "SERIAL"], lines
        cells = ["10", "pre-operational", "-", "python-canopen", "pressure", "transmitter", "0x00001234", "0x00000001",
                 "0x00020004", "1010"]
        assert len(lines) == 3 and lines[1].split() == cells, lines
        # A passive scan finds them by their heartbeats.
        passive = cangauge.run("scan", "--passive", "--format", "json", "--timeout", "3s").json()
        assert [(node["node"], node["state"]) for node in passive] == [(10, "pre-operational"), (11, "pre-operational")]
        # The scan of given nodes ends when they have answered. A missing node is not listed.
        some = cangauge.run("scan", "9-11", "--format", "json", "--timeout", "1s").json()
        assert [node["node"] for node in some] == [10, 11], some
    cangauge.run("scan", "10,11", exit=3)


def sdo_read(cangauge, directory):
    def read(*arguments, **options):
        return cangauge.run(*PATIENT, "sdo", "read", *arguments, **options).out

    with devices(cangauge.interface, directory, *PAIR):
        # Expedited transfers of each size, and with a type given by the user.
        assert read(10, "0x1018:1") == "4660\n"
        assert read(10, "1018h:4") == "1010\n"
        assert read(10, "1000") == "131476\n"
        assert read(10, "1017") == "0\n"
        assert read(10, "1018:1", "--hex") == "0x00001234\n"
        assert read(10, "6130:1", "--type", "r32") == "-100\n"
        assert read(11, "9130:1", "--type", "i32") == "-5000\n"
        # A transfer with several segments.
        assert read(10, "1008") == "python-canopen pressure transmitter\n"
        assert read(10, "2001", "--type", "vs") == "as delivered\n"
        # The type is unknown: the bytes are printed.
        assert read(10, "2000") == "EF BE\n"
        assert read(10, "2000", "--type", "u16") == "48879\n"
        assert read(10, "vendor-id", "1018:4") == "vendor-id 4660\n0x1018:4 1010\n"
        path = os.path.join(directory, "bytes")
        assert read(10, "1008", "--output", path) == ""
        with open(path, "rb") as file:
            assert file.read() == b"python-canopen pressure transmitter"
        line = json.loads(read(10, "1018:1", "--format", "json"))
        assert line == {"node": 10, "object": "0x1018:1", "name": "vendor-id", "type": "u32", "value": 4660,
                        "raw": "0x34120000"}, line
        # Rejected: the abort code of the device is printed.
        refused = cangauge.run(*PATIENT, "sdo", "read", 10, "3000", exit=4)
        assert refused.out == "" and "0x06020000" in refused.err, refused
        refused = cangauge.run(*PATIENT, "--format", "json", "sdo", "read", 10, "1018:9", exit=4)
        error = json.loads(refused.err)["error"]
        assert (error["kind"], error["exit"], error["node"], error["object"]) == ("refused", 4, 10, "0x1018:9"), error
        assert error["abort"] == "0x06090011", error


def sdo_write(cangauge, directory):
    def write(*arguments, **options):
        return cangauge.run(*PATIENT, "sdo", "write", *arguments, **options)

    def read(*arguments):
        return cangauge.run(*PATIENT, "sdo", "read", *arguments).out.strip()

    with devices(cangauge.interface, directory, *PAIR):
        write(10, "1017", 250, "--verify")
        assert read(10, "1017") == "250"
        write(10, "producer-heartbeat-time", 0)
        assert read(10, "1017") == "0"
        write(10, "6132:1", 3, "--type", "u8")
        assert read(10, "6132:1", "--type", "u8") == "3"
        # The type follows from reading the object.
        write(10, "2000", 513, "--verify")
        assert read(10, "2000") == "01 02"
        # A segmented download.
        text = "a text that needs several segments"
        write(10, "2001", text, "--type", "vs", "--verify")
        assert read(10, "2001", "--type", "vs") == text
        path = os.path.join(directory, "input")
        with open(path, "wb") as file:
            file.write(bytes(range(1, 200)))
        write(10, "2001", "--input", path)
        assert read(10, "2001", "--bytes") == bytes(range(1, 200)).hex(" ").upper()
        # Several objects in one command.
        write(11, "1017=300", "2000=1")
        assert read(11, "1017") == "300" and read(11, "2000") == "01 00"
        # Too large: nothing is sent. Read-only or missing: the device rejects it and keeps its value.
        write(10, "1017", 65536, exit=2)
        write(10, "1018:1", 5, exit=4)
        write(10, "3000", 5, "--type", "u8", exit=4)
        assert read(10, "1017") == "0" and read(10, "1018:1") == "4660"


def absent(cangauge, directory):
    """Exit code 3 after all attempts; the message names the missing node."""
    with devices(cangauge.interface, directory, *PAIR):
        for command in (["sdo", "read", ABSENT, "1000"], ["sdo", "write", ABSENT, "1017", 100],
                        ["read", ABSENT], ["log", ABSENT], ["log", ABSENT, "--poll", "100ms"]):
            result = cangauge.run(*command, "--timeout", "200ms", "--retries", "2", exit=3)
            assert result.seconds >= 0.6, result
            assert f"node {ABSENT}" in result.err and result.out == "", result
        assert cangauge.run("nmt", "state", ABSENT, exit=3).out.split() == [str(ABSENT), "-", "none"]
        # Some nodes exist and some do not: each is named.
        result = cangauge.run("--timeout", "2s", "nmt", "state", f"10,{ABSENT}", exit=7)
        assert f"node {ABSENT}" in result.err and "node 10" not in result.err, result


def nmt(cangauge, directory):
    def state(heartbeat, *command):
        result = cangauge.run(*PATIENT, "nmt", *command, "--format", "json")
        lines = [(line["node"], line["state"], line["by"]) for line in result.json()]
        assert len(lines) == 1, result
        return lines[0]

    with devices(cangauge.interface, directory, *PAIR, heartbeat=100) as record:
        assert state(True, "state", 10) == (10, "pre-operational", "heartbeat")
        for command, name in (("start", "operational"), ("stop", "stopped"), ("start", "operational"),
                              ("preop", "pre-operational"), ("stop", "stopped"), ("preop", "pre-operational")):
            assert state(True, command, 10) == (10, name, "heartbeat"), command
            assert state(True, "state", 10) == (10, name, "heartbeat"), command
        # TPDOs were sent while the node was operational, and no other node was started.
        assert record(10) and not record(11)
        for command in ("reset", "reset-comm"):
            assert state(True, "start", 10)[1] == "operational"
            assert state(True, command, 10) == (10, "pre-operational", "heartbeat"), command
            assert state(True, "state", 10)[1] == "pre-operational", command
        both = cangauge.run(*PATIENT, "nmt", "start", "10,11", "--confirm", "--format", "json").json()
        assert both == [{"node": node, "state": "operational", "by": "heartbeat"} for node in (10, 11)], both
        broadcast = cangauge.run("--timeout", "2s", "nmt", "preop", "all", "--format", "json").json()
        assert broadcast == [{"node": node, "state": "pre-operational", "by": "heartbeat"} for node in (10, 11)], broadcast
        cangauge.run("nmt", "start", 11, "--no-wait")
        wait_for(lambda: record(11), lambda: "nmt start --no-wait started no node")
    with devices(cangauge.interface, directory, *PAIR):
        # Without a heartbeat the state is unknown, and it is not guessed.
        answers = cangauge.run("--timeout", "1s", "nmt", "start", 10, "--format", "json")
        assert answers.json() == [{"node": 10, "state": None, "by": "none"}], answers
        cangauge.run("--timeout", "1s", "nmt", "start", 10, "--confirm", exit=3)
        assert state(False, "reset", 10) == (10, None, "boot-up")


def read(cangauge, directory):
    with devices(cangauge.interface, directory, *PAIR, "12:overload"):
        assert cangauge.run(*PATIENT, "read", 10, "ch1").out == "-100\n"
        lines = cangauge.run(*PATIENT, "read", "10,11", "--format", "json").json()
        assert lines == [
            {"node": 10, "signal": "ch1", "value": -100.0, "unit": "bar", "status": "ok"},
            {"node": 11, "signal": "ch1", "value": -5.0, "unit": "psi", "status": "ok"},
        ], lines
        assert float(cangauge.run(*PATIENT, "read", 10, "ch1", "--in", "mbar").out) == -100000
        text = cangauge.run(*PATIENT, "read", 11).out.split()
        assert text[:4] == ["11", "ch1", "-5", "psi"], text
        cangauge.run(*PATIENT, "read", 10, "temperature", exit=2)
        # Each TPDO increments the value; the 5th and its two neighbours have an invalid status.
        seen = set()
        cangauge.run(*PATIENT, "log", 12, "--count", 5)
        cangauge.run("nmt", "preop", 12, "--timeout", "1s")
        line = cangauge.run(*PATIENT, "read", 12, "--format", "json").json()[0]
        assert line["status"] in ("ok", "invalid", "overload-high", "overload-low"), line
        assert (line["value"] is None) == (line["status"] != "ok"), line


def python_master_reads_simulated_devices(cangauge, directory):
    """python-canopen reads all four simulated devices; their objects contain the values that they send."""
    record = os.path.join(directory, "truth.csv")
    bench = os.path.join(directory, "bench.toml")
    with open(bench, "w", encoding="ascii") as file:
        file.write(f'record = "{record}"\n')
        for kind, node in (("mh4", 1), ("d20", 2), ("mc1609", 3), ("dps", 127)):
            file.write(f'[[device]]\nkind = "{kind}"\nnode = {node}\nserial = {5000 + node}\n')
    command = [sys.executable, os.path.join(HERE, "master.py"), "--sync"]
    answers = []
    with cangauge.simulator(bench, directory) as simulator:
        # The types of the D-20-9 and the DPS, from their manuals.
        for arguments in (["1", "2", "3"], ["127"]):
            own = ["--type", "6130=INTEGER32"] if arguments == ["127"] else []
            done = subprocess.run([*command, *own, cangauge.interface, *arguments], stdout=subprocess.PIPE, text=True,
                                  timeout=GIVE_UP, check=True)
            answers += [json.loads(line) for line in done.stdout.splitlines()]
        simulator.finish()
    with open(record, encoding="ascii") as file:
        sent = [line.split(",") for line in file.read().splitlines()[1:]]
    identities = {1: [71, 1], 2: [71, 1], 3: [285, 5641], 127: [866, 4469072]}
    names = {1: "MH-4-CAN", 2: "D2X9", 3: None, 127: "DPS"}
    assert [answer["node"] for answer in answers] == [1, 2, 3, 127]
    for answer in answers:
        node = answer["node"]
        assert answer["identity"][:2] == identities[node] and answer["identity"][3] == 5000 + node, answer
        assert answer["name"] == names[node], answer
        assert answer["states"] == ["PRE-OPERATIONAL", "OPERATIONAL", "PRE-OPERATIONAL"], answer
        received = []
        for tpdo in answer["tpdos"]:
            for values in tpdo["values"]:
                mapped = [entry.split("/") for entry in tpdo["mapping"]]
                # A status byte has no separate row.
                received += [own_bytes(entry, bits, value) for (entry, bits), value in zip(mapped, values)
                             if not entry.startswith("6150")]
        of_node = [raw for _, number, _, _, _, _, raw in sent if int(number) == node]
        assert received and contains_in_order(of_node, received, answer["tpdos"]), (node, received, of_node)


def own_bytes(entry, bits, value):
    if isinstance(value, float):
        return "0x" + struct.pack("<f", value).hex().upper()
    return "0x" + value.to_bytes(int(bits) // 8, "little", signed=True).hex().upper()


def contains_in_order(sent, received, tpdos):
    """Whether each received value was sent, in the same order for each TPDO."""
    count = sum(len(tpdo["values"]) * sum(not entry.startswith("6150") for entry in tpdo["mapping"]) for tpdo in tpdos)
    assert count == len(received)
    at = 0
    for tpdo in tpdos:
        width = sum(not entry.startswith("6150") for entry in tpdo["mapping"])
        rest = iter(sent)
        for _ in tpdo["values"]:
            if any(value not in rest for value in received[at:at + width]):
                return False
            at += width
    return True


CHECKS = [scan, sdo_read, sdo_write, absent, nmt, read, python_master_reads_simulated_devices]
