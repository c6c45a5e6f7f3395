"""The rules that hold for each run with any faults."""

import re

from scenario import claims, recording, wire

EXITS = {0, 1, 2, 3, 4, 5, 6, 7, 8, 130}
# The objects that each command may change. Commands that are not listed change nothing.
CHANGES = {
    "pdo map": lambda index: 0x1800 <= index < 0x1C00,
    "autozero": lambda index: index & 0xFF0 == 0x120,
    "unit": lambda index: index >= 0x2000,
    "filter": lambda index: index in (0x61A0, 0x61A1, 0x2023),
    "limits": lambda index: 0x133 <= index & 0xFFF <= 0x136,
    "restore": lambda _: True,
    # COB-IDs that contain the node-ID.
    "set-id": lambda index: index == 0x1014 or 0x1800 <= index < 0x1A00 or index in (0x2003, 0x2320, 0x2321),
    "set-bitrate": lambda index: index in (0x2004, 0x2320, 0x2321),
    "probe": lambda index: False,
    "startup": lambda index: index in (0x1F80, 0x2330),
}
HEARTBEAT = (0x1017, 0)


def judge(scenario, run):
    """The broken rules as text, from the state right after the command."""
    problems = ends(scenario, run) + wire.judge(scenario, run.record)
    problems += others(scenario, run) + own(scenario, run) + states(scenario, run) + configuring(scenario, run)
    problems += mapping(scenario, run)
    return problems


def ends(scenario, run):
    problems = []
    if run.overran:
        problems.append("does not end")
    if "panicked" in run.err or run.exit == 101:
        problems.append("panics")
    interrupted = scenario.signal and scenario.signal[0] != "SIGKILL"
    killed = scenario.signal and scenario.signal[0] == "SIGKILL"
    if run.exit not in EXITS and not (run.exit == -9 and (killed or run.overran)):
        problems.append(f"exit code {run.exit}")
    if run.exit == 130 and not interrupted:
        problems.append("it was not interrupted")
    if run.exit == 130 and run.rows:
        problems.append("a recording has a result")
    if run.exit == 5 and "down" not in scenario.kinds_of_trouble():
        problems.append("the bus works")
    if not run.overran and run.exit and run.exit > 0 and not run.err.strip() and run.exit != 1:
        problems.append("there is no error message")
    if not scenario.is_troubled() and run.exit == 3 and all(scenario.at(node) for node in scenario.named) and not may_be_silent(scenario):
        problems.append("all devices answer")
    return problems


def may_be_silent(scenario):
    """Objects and states to ignore: waiting TPDOs, unknown states, the new node-ID, which is free."""
    return scenario.command in ("log", "check", "set-id", "nmt", "probe")


def differences(before, after, ignored=lambda place: False):
    """The objects that have changed."""
    return [f"{place[0]:04X}h:{place[1]} was {old.hex()} and is {after[place].hex()}" for place, old in before.items()
            if old is not None and after.get(place) is not None and after[place] != old and not ignored(place)]


def others(scenario, run):
    """A device that was not named keeps its values and its state."""
    problems = []
    for node, before in run.before.objects.items():
        if node in scenario.named:
            continue
        meddled = scenario.was_written_by_others(node)
        problems += [f"node {node} was not named: {difference}" for difference in
                 differences(before, run.after.objects[node], lambda place: meddled and place == HEARTBEAT)]
        problems += [f"node {node} was not named, after a reset: {difference}"
                 for difference in differences(run.fresh.objects[node], run.reset.objects[node])]
        states = run.before.states[node], run.after.states[node]
        if not scenario.is_commanded_by_others(node) and None not in states and states[0] != states[1]:
            problems.append(f"node {node} was not named: {states[0]} and now {states[1]}")
    return problems


def own(scenario, run):
    """A named device has changed only in objects of the command."""
    problems = []
    for node in set(scenario.named) & run.before.objects.keys():
        before, after = run.before.objects[node], run.after.objects[node]
        may = CHANGES.get(scenario.command, lambda index: False) if wire.writes(scenario) else lambda index: False
        resets = scenario.command in ("nmt", "store", "restore", *wire.LSS)
        free = scenario.was_written_by_others(node) or resets
        # A heartbeat that was switched on briefly is off again only if the frames for that arrived.
        if scenario.command in ("probe", "pdo map", "store", "restore") and (lost(run) or run.exit == -9):
            free = True

        def ignored(place):
            target = scenario.wanted.get("object") if scenario.command == "sdo write" else None
            return place == target or may(place[0]) or free and place == HEARTBEAT

        problems += [f"node {node}: {difference}" for difference in differences(before, after, ignored)]
        if not wire.writes(scenario):
            problems += [f"node {node}, after a reset: {difference}"
                     for difference in differences(run.fresh.objects[node], run.reset.objects[node])]
        # According to the output of the program.
        if "nothing was changed" in run.err and not scenario.was_written_by_others(node) and not resets:
            problems += [f"node {node}, and nothing was changed: {difference}" for difference in differences(before, after)]
    return problems


def lost(run):
    """Whether a frame of the program was lost or changed, or its interface was down."""
    return any(direction == wire.OUT and kind or kind == "down" for _, direction, kind, *_ in run.record)


def states(scenario, run):
    """NMT states that the command changed are restored."""
    if scenario.command == "nmt" or run.exit == -9:
        return []
    problems = []
    switches = wire.commands(scenario)
    for node in set(scenario.named) & run.before.states.keys():
        before, after = run.before.states[node], run.after.states[node]
        if None in (before, after) or before == after or scenario.is_commanded_by_others(node):
            continue
        if switches and (not is_told(scenario, node) or lost(run) or scenario.is_disordered() or
                         {"lose", "cut", "garble", "truncate", "stopped"} & scenario.kinds_of_trouble()):
            continue
        # A state that could not be restored is reported for this node.
        said = [line for line in run.err.splitlines() if re.search(rf"\b{node}\b", line)]
        if not re.search("not put back|stays?\b|state|left", "\n".join(said)):
            problems.append(f"node {node} was {before} and is {after}")
    return problems


def is_told(scenario, node):
    """Whether heartbeats showed the state all the time."""
    device = scenario.at(node)
    return device is not None and (HEARTBEAT in device["set"] or device["unsaved"]) and scenario.command not in wire.LSS


def configuring(scenario, run):
    """No slave is left in LSS configuration state, unless it was unavoidable."""
    if scenario.command not in wire.LSS or run.exit == -9 or not run.configuring or lost(run):
        return []
    excused = scenario.is_commanded_by_others() or any(device["lss"] for device in scenario.devices) or "stopped" in scenario.kinds_of_trouble()
    return [] if excused else [f"in configuration state: {[answer.hex() for answer in run.configuring]}"]


def mapping(scenario, run):
    """After a failed `pdo map` the device has the old or the new mapping, or the message names the state and a remedy."""
    node, wanted = scenario.named[0], scenario.wanted
    if scenario.command != "pdo map" or run.exit in (0, -9) or scenario.restarts(node) or node not in run.before.objects:
        return []
    offset, after = wanted["pdo"] - 1, run.after.objects[node]
    half = differences(run.before.objects[node], after, lambda place: place[0] not in (0x1800 + offset, 0x1A00 + offset))
    right = [((0x1800 + offset, 2), wanted["code"]), ((0x1800 + offset, 5), wanted["timer"])]
    right += [((0x1A00 + offset, sub), word) for sub, word in enumerate([len(wanted["words"]), *wanted["words"]])] if wanted["words"] else []
    is_new = all(number is None or int.from_bytes(after.get(place) or b"", "little") == number for place, number in right)
    return [] if is_new or re.search("half changed|is not known|cangauge pdo map", run.err) else half


def rows(scenario, run, truth):
    return recording.judge(scenario, run, truth)


def claim(scenario, run, foreign):
    """Checks the claims of a successful exit code."""
    if run.exit != 0 and scenario.command != "check" or scenario.command == "check" and run.exit not in (0, 1):
        return []
    return claims.complaints(scenario, run, foreign)
