"""What must always hold, whatever went wrong."""

import re

from scenario import claims, recording, wire

EXITS = {0, 1, 2, 3, 4, 5, 6, 7, 8, 130}
# What a command that writes may change; what is not here changes nothing.
CHANGES = {
    "pdo map": lambda index: 0x1800 <= index < 0x1C00,
    "autozero": lambda index: index & 0xFF0 == 0x120,
    "unit": lambda index: index >= 0x2000,
    "filter": lambda index: index in (0x61A0, 0x61A1, 0x2023),
    "limits": lambda index: 0x133 <= index & 0xFFF <= 0x136,
    "restore": lambda _: True,
    # COB-IDs that are made of the node-ID.
    "set-id": lambda index: index == 0x1014 or 0x1800 <= index < 0x1A00 or index in (0x2003, 0x2320, 0x2321),
    "set-bitrate": lambda index: index in (0x2004, 0x2320, 0x2321),
    "probe": lambda index: False,
    "startup": lambda index: index in (0x1F80, 0x2330),
}
HEARTBEAT = (0x1017, 0)


def judge(scenario, run):
    """The rules that were broken, in words, by what stands there right after the command."""
    told = ends(scenario, run) + wire.judge(scenario, run.record)
    told += others(scenario, run) + own(scenario, run) + states(scenario, run) + configuring(scenario, run)
    told += mapping(scenario, run)
    return told


def ends(scenario, run):
    told = []
    if run.overran:
        told.append("does not end")
    if "panicked" in run.err or run.exit == 101:
        told.append("panics")
    interrupted = scenario.signal and scenario.signal[0] != "SIGKILL"
    killed = scenario.signal and scenario.signal[0] == "SIGKILL"
    if run.exit not in EXITS and not (run.exit == -9 and (killed or run.overran)):
        told.append(f"exit code {run.exit}")
    if run.exit == 130 and not interrupted:
        told.append("nobody interrupted it")
    if run.exit == 130 and run.rows:
        told.append("a recording has a result")
    if run.exit == 5 and "down" not in scenario.kinds_of_trouble():
        told.append("the bus works")
    if not run.overran and run.exit and run.exit > 0 and not run.err.strip() and run.exit != 1:
        told.append("says nothing")
    if not scenario.is_troubled() and run.exit == 3 and all(scenario.at(node) for node in scenario.named) and not may_be_silent(scenario):
        told.append("everybody answers")
    return told


def may_be_silent(scenario):
    """TPDOs that wait for something; states that nothing tells; the new node-ID, which is free."""
    return scenario.command in ("log", "check", "set-id", "nmt", "probe")


def differences(before, after, ignored=lambda place: False):
    """What was there before and is another thing now."""
    return [f"{place[0]:04X}h:{place[1]} was {old.hex()} and is {after[place].hex()}" for place, old in before.items()
            if old is not None and after.get(place) is not None and after[place] != old and not ignored(place)]


def others(scenario, run):
    """Who was not named holds what it held, and is in the state that it was in."""
    told = []
    for node, before in run.before.held.items():
        if node in scenario.named:
            continue
        meddled = scenario.was_written_by_others(node)
        told += [f"node {node} was not named: {difference}" for difference in
                 differences(before, run.after.held[node], lambda place: meddled and place == HEARTBEAT)]
        told += [f"node {node} was not named, after a reset: {difference}"
                 for difference in differences(run.fresh.held[node], run.reset.held[node])]
        states = run.before.states[node], run.after.states[node]
        if not scenario.is_commanded_by_others(node) and None not in states and states[0] != states[1]:
            told.append(f"node {node} was not named: {states[0]} and now {states[1]}")
    return told


def own(scenario, run):
    """Who was named has changed in nothing but what the command is about."""
    told = []
    for node in set(scenario.named) & run.before.held.keys():
        before, after = run.before.held[node], run.after.held[node]
        may = CHANGES.get(scenario.command, lambda index: False) if wire.writes(scenario) else lambda index: False
        resets = scenario.command in ("nmt", "store", "restore", *wire.LSS)
        free = scenario.was_written_by_others(node) or resets
        # A heartbeat that was switched on for a moment is off again only if its own frames got through.
        if scenario.command in ("probe", "pdo map", "store", "restore") and (lost(run) or run.exit == -9):
            free = True

        def ignored(place):
            target = scenario.wanted.get("object") if scenario.command == "sdo write" else None
            return place == target or may(place[0]) or free and place == HEARTBEAT

        told += [f"node {node}: {difference}" for difference in differences(before, after, ignored)]
        if not wire.writes(scenario):
            told += [f"node {node}, after a reset: {difference}"
                     for difference in differences(run.fresh.held[node], run.reset.held[node])]
        # By the program's own words.
        if "nothing was changed" in run.err and not scenario.was_written_by_others(node) and not resets:
            told += [f"node {node}, and nothing was changed: {difference}" for difference in differences(before, after)]
    return told


def lost(run):
    """Whether anything that the program sent did not get there as it was, or its interface was down."""
    return any(direction == wire.OUT and kind or kind == "down" for _, direction, kind, *_ in run.record)


def states(scenario, run):
    """What was switched on the way is put back."""
    if scenario.command == "nmt" or run.exit == -9:
        return []
    told = []
    switches = wire.commands(scenario)
    for node in set(scenario.named) & run.before.states.keys():
        before, after = run.before.states[node], run.after.states[node]
        if None in (before, after) or before == after or scenario.is_commanded_by_others(node):
            continue
        if switches and (not is_told(scenario, node) or lost(run) or scenario.is_disordered() or
                         {"lose", "cut", "garble", "truncate", "stopped"} & scenario.kinds_of_trouble()):
            continue
        # What could not be put back is said of that node.
        said = [line for line in run.err.splitlines() if re.search(rf"\b{node}\b", line)]
        if not re.search("not put back|stays?\b|state|left", "\n".join(said)):
            told.append(f"node {node} was {before} and is {after}")
    return told


def is_told(scenario, node):
    """Whether a heartbeat told the state all the time."""
    device = scenario.at(node)
    return device is not None and (HEARTBEAT in device["set"] or device["unsaved"]) and scenario.command not in wire.LSS


def configuring(scenario, run):
    """Nobody is left in LSS configuration state, unless it could not be helped."""
    if scenario.command not in wire.LSS or run.exit == -9 or not run.configuring or lost(run):
        return []
    excused = scenario.is_commanded_by_others() or any(device["lss"] for device in scenario.devices) or "stopped" in scenario.kinds_of_trouble()
    return [] if excused else [f"in configuration state: {[answer.hex() for answer in run.configuring]}"]


def mapping(scenario, run):
    """`pdo map` that failed has left the old mapping or the new one, or says how it was left and what mends it."""
    node, wanted = scenario.named[0], scenario.wanted
    if scenario.command != "pdo map" or run.exit in (0, -9) or scenario.restarts(node) or node not in run.before.held:
        return []
    offset, after = wanted["pdo"] - 1, run.after.held[node]
    half = differences(run.before.held[node], after, lambda place: place[0] not in (0x1800 + offset, 0x1A00 + offset))
    right = [((0x1800 + offset, 2), wanted["code"]), ((0x1800 + offset, 5), wanted["timer"])]
    right += [((0x1A00 + offset, sub), word) for sub, word in enumerate([len(wanted["words"]), *wanted["words"]])] if wanted["words"] else []
    is_new = all(number is None or int.from_bytes(after.get(place) or b"", "little") == number for place, number in right)
    return [] if is_new or re.search("half changed|is not known|cangauge pdo map", run.err) else half


def rows(scenario, run, truth):
    return recording.judge(scenario, run, truth)


def claim(scenario, run, foreign):
    """What an exit code of success says, looked up."""
    if run.exit != 0 and scenario.command != "check" or scenario.command == "check" and run.exit not in (0, 1):
        return []
    return claims.complaints(scenario, run, foreign)
