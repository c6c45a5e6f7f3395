"""Exit code 0 requires that the devices contain the requested values. This is read with python-canopen, and again after
a reset if the values were stored.

Each function takes the scenario, the run and the foreign judge, and returns complaints. Values that another master
changed, or that a device lost with its power, are not checked.
"""

import json
import math

from scenario import kinds

TARGETS = {"start": "operational", "stop": "stopped", "preop": "pre-operational"}


def rows(run):
    return [json.loads(line) for line in run.out.splitlines() if line.startswith("{")]


def complaints(scenario, run, foreign):
    """The claims of the program that are wrong; empty if it claims nothing."""
    claim = CLAIMS.get(scenario.command)
    return claim(scenario, run, foreign) if claim else []


def after_reset(scenario, run, foreign):
    """The same check of stored values after a restart of the devices."""
    options = scenario.arguments
    if scenario.command == "set-id" and scenario.wanted["stored"]:
        return set_id(scenario, run, foreign)
    if scenario.command == "pdo map" and "--store" in options:
        return pdo_map(scenario, run, foreign)
    if scenario.command == "autozero" and "--store" in options and "--dry-run" not in options:
        return autozero(scenario, run, foreign)
    if scenario.command == "store" and scenario.wanted["group"] != "app":
        return heartbeat(scenario, foreign, scenario.at(scenario.named[0])["unsaved"])
    if scenario.command == "restore" and scenario.wanted["group"] != "app":
        kind = scenario.at(scenario.named[0])["kind"]
        return heartbeat(scenario, foreign, kinds.objects(kind)[0x1017, 0].default or 0)
    return []


def heartbeat(scenario, foreign, wanted):
    node = scenario.named[0]
    if scenario.was_written_by_others(node):
        return []
    found = foreign.number(scenario.at(node)["kind"], node, (0x1017, 0))
    return [] if found == wanted else [f"1017h is {found}, not {wanted}"]


def sdo_read(scenario, run, foreign):
    node, place = scenario.named[0], scenario.wanted["object"]
    printed, found = bytes.fromhex(rows(run)[0]["raw"][2:]), foreign.read(node, place)
    width = kinds.objects(scenario.at(node)["kind"])[place].width
    if place == (0x1017, 0) and scenario.was_written_by_others(node):
        return []
    return [] if found is not None and printed == found[:width] else [f"read {printed.hex()}, and it is {found and found.hex()}"]


def sdo_write(scenario, _, foreign):
    node, place = scenario.named[0], scenario.wanted["object"]
    if place == (0x1017, 0) and scenario.was_written_by_others(node) or scenario.restarts(node):
        return []
    found = foreign.number(scenario.at(node)["kind"], node, place)
    return [] if found == scenario.wanted["value"] else [f"{place} is {found}, not {scenario.wanted['value']}"]


def nmt(scenario, run, _):
    """Checks confirmed states. A boot-up confirms a restart and no state."""
    if "--no-wait" in scenario.arguments or scenario.is_commanded_by_others() or scenario.is_disordered():
        return []
    problems = []
    for row in rows(run):
        state, node = row["state"], row["node"]
        # A missing answer proves that a node is stopped. An unplugged cable has the same effect.
        if row["by"] in ("none", "boot-up", "sdo") or state is None or run.after.states.get(node) == state:
            continue
        problems.append(f"node {node} is {run.after.states.get(node)}, not {state} by {row['by']}")
    if "--confirm" in scenario.arguments:
        problems += [f"not confirmed: {row}" for row in rows(run) if row["by"] == "none"]
    return problems


def pdo_map(scenario, _, foreign):
    node, wanted = scenario.named[0], scenario.wanted
    kind, offset = scenario.at(node)["kind"], scenario.wanted["pdo"] - 1
    if scenario.restarts(node) and "--store" not in scenario.arguments:
        return []
    problems = []

    def compare(place, right):
        found = foreign.number(kind, node, place)
        if found != right:
            problems.append(f"{place[0]:04X}h:{place[1]} is {found}, not {right}")

    if wanted["code"] is not None:
        compare((0x1800 + offset, 2), wanted["code"])
    if wanted["timer"] is not None:
        compare((0x1800 + offset, 5), wanted["timer"])
    if wanted["words"]:
        compare((0x1A00 + offset, 0), len(wanted["words"]))
        for sub, word in enumerate(wanted["words"], 1):
            compare((0x1A00 + offset, sub), word)
    cob_id = foreign.number(kind, node, (0x1800 + offset, 1))
    if cob_id is None or cob_id >> 31 and not run_before(scenario, node, (0x1800 + offset, 1)) >> 31:
        problems.append(f"its COB-ID is {cob_id}")
    return problems


def run_before(scenario, node, place):
    return int.from_bytes(scenario.before.objects[node].get(place) or b"", "little")


def autozero(scenario, run, foreign):
    node = scenario.named[0]
    if "--dry-run" in scenario.arguments or scenario.restarts(node):
        return []
    way = kinds.description(scenario.at(node)["kind"])["autozero"][0]
    problems, (row, *_) = [], rows(run)
    kind, place = scenario.at(node)["kind"], kinds.at(way["offset"])
    signal = next(signal for signal in kinds.signals(kind) if signal["channel"] == way["channel"])
    scale = scaled(foreign, kind, node, signal)
    found = foreign.number(kind, node, place)
    if found is None or not math.isclose(found * (1 if kinds.objects(kind)[place].type == "r32" else scale), row["offset"], rel_tol=1e-5, abs_tol=1e-6):
        problems.append(f"the offset is {found} by {scale}, not {row['offset']}")
    reading = foreign.number(kind, node, kinds.at(signal["value"]))
    start, end = ends(kind, way["channel"])
    if reading is None or abs(reading * scale) > 0.001 * (end - start):
        problems.append(f"reads {reading} by {scale} after it")
    return problems


def ends(kind, number):
    channel = next(c for c in kinds.model(kind)["channel"] if c["channel"] == number)
    return channel["start"], channel["end"]


def scaled(foreign, kind, node, signal):
    """The size of one step of an integer value."""
    if kinds.objects(kind)[kinds.at(signal["value"])].type == "r32":
        return 1
    digits = foreign.number(kind, node, kinds.at(signal["digits"])) if "digits" in signal else None
    return 10.0 ** -(digits if digits is not None else signal.get("fixed_digits", 0))


def unit(scenario, _, foreign):
    node, signal = scenario.named[0], scenario.wanted["signal"]
    codes = {"bar": 0x4E0000, "psi": 0xAB0000, "MPa": 0x06220000, "kPa": 0x03220000, "mbar": 0xFD4E0000, "degC": 0x2D0000,
             "degF": 0xAC0000, "K": 0x050000}
    if scenario.restarts(node):
        return []
    found = foreign.number(scenario.at(node)["kind"], node, kinds.at(signal["unit"]))
    wanted = codes[scenario.wanted["unit"]]
    return [] if found == wanted else [f"the unit is {found and hex(found)}, not {hex(wanted)}"]


def damping(scenario, _, foreign):
    node, signal = scenario.named[0], scenario.wanted["signal"]
    if scenario.restarts(node):
        return []
    found = foreign.number(scenario.at(node)["kind"], node, (0x61A1, signal["channel"]))
    return [] if found == scenario.wanted["constant"] else [f"the constant is {found}"]


def limits(scenario, _, foreign):
    node, signal = scenario.named[0], scenario.wanted["signal"]
    kind = scenario.at(node)["kind"]
    if scenario.restarts(node):
        return []
    problems, base = [], kinds.at(signal["value"])[0] & 0xF000
    for index, name in ((0x134, "low"), (0x135, "high")):
        found = foreign.number(kind, node, (base + index, signal["channel"]))
        if found is None or not math.isclose(found * scaled(foreign, kind, node, signal), scenario.wanted[name]):
            problems.append(f"{base + index:04X}h is {found}, not {scenario.wanted[name]}")
    return problems


def read(scenario, run, foreign):
    problems = []
    for row in rows(run):
        device = scenario.at(row["node"])
        signal = next(signal for signal in kinds.signals(device["kind"]) if signal["name"] == row["signal"])
        found = foreign.number(device["kind"], row["node"], kinds.at(signal["value"]))
        scale = scaled(foreign, device["kind"], row["node"], signal)
        if row["value"] is not None and (found is None or not math.isclose(found * scale, row["value"], rel_tol=1e-6, abs_tol=1e-9)):
            problems.append(f"{row} and it is {found} by {scale}")
    return problems


def scan(scenario, run, _):
    found = {row["node"]: row for row in rows(run)}
    there = {device["node"]: device for device in scenario.devices}
    problems = [f"no device has node {node}" for node in found if node not in there]
    for node in found.keys() & there.keys():
        serial, device = found[node].get("serial"), there[node]
        if serial is not None and serial != device["serial"]:
            problems.append(f"node {node} is {device['serial']}, not {serial}")
        if found[node].get("device") not in (None, device["kind"]):
            problems.append(f"node {node} is {device['kind']}, not {found[node]['device']}")
    if not scenario.is_troubled() and found.keys() != there.keys() & set(scenario.named):
        problems.append(f"found {sorted(found)}")
    return problems


def check(scenario, run, _):
    # Values are constant, so a recording without invalid values is not required here.
    return [] if scenario.wanted["holds"] == (run.exit == 0) else [f"exit {run.exit}, and it holds: {scenario.wanted['holds']}"]


def set_id(scenario, run, foreign):
    """The device with the serial number has the new node-ID, and no device has the old one."""
    new, old = scenario.wanted["new"], scenario.wanted["old"]
    if scenario.restarts(old or new) and not scenario.wanted["stored"]:
        return []
    problems, serial = [], foreign.read(new, (0x1018, 4))
    if serial is None or int.from_bytes(serial, "little") != scenario.wanted["serial"]:
        problems.append(f"node {new} is {serial}")
    if old not in (None, new) and foreign.read(old, (0x1018, 4), 0.5) is not None:
        problems.append(f"a device still has node {old}")
    return problems


CLAIMS = {"sdo read": sdo_read, "sdo write": sdo_write, "nmt": nmt, "pdo map": pdo_map, "autozero": autozero, "unit": unit, "filter": damping,
          "limits": limits, "read": read, "scan": scan, "check": check, "set-id": set_id}
