"""Each row of a recording is a value that was sent, in order, without repetitions."""

import csv

from scenario.relay import IN

# The columns of the record of the simulator.
COLUMNS = ("node", "signal", "value", "unit", "status", "raw")


def rows_of(table):
    """The complete lines of a table; a truncated last line is not a row."""
    whole = table[: table.rfind("\n") + 1]
    return [tuple(row[column] for column in COLUMNS) for row in csv.DictReader(whole.splitlines())]


def judge(scenario, run, truth):
    rows = run.rows
    problems = []
    count = scenario.wanted["count"]
    if count is not None and len(rows) > count:
        problems.append(f"{len(rows)} rows of {count}")
    if run.exit == 0 and count is not None and len(rows) < count and not scenario.is_troubled() and run.seconds < 3:
        problems.append(f"{len(rows)} rows of {count}, and it ended")
    if not run.is_whole and run.exit != -9:
        problems.append("the last line is cut off")
    if scenario.wanted["poll"]:
        return problems + polled(rows, run.record)
    return problems + sent(scenario, rows, truth)


def polled(rows, record):
    """Each row is an answer of its node."""
    answers = {}
    for _, direction, _, _, identifier, data in record:
        if direction == IN and data and 0x580 < identifier < 0x600 and len(data) == 8 and data[0] >> 5 == 2:
            for end in range(5, 9):
                answers.setdefault(identifier & 0x7F, set()).add(data[4:end])
    return [f"no node answered {row}" for row in rows if bytes.fromhex(row[5][2:]) not in answers.get(int(row[0]), ())][:1]


def sent(scenario, rows, truth):
    """Compares rows with the record. Values that could not be read (a unit, the digits) may be empty."""
    disordered = scenario.is_disordered()
    rest, twice = list(truth), 8 * sum(kind == "double" for _, _, kind, _ in scenario.faults)
    troubled = scenario.is_troubled()
    at = 0
    for number, row in enumerate(rows):
        places = range(len(rest)) if disordered else range(at, len(rest))
        place = next((place for place in places if rest[place] and is_same(row, rest[place], troubled)), None)
        if place is None and twice and any(is_same(row, line, troubled) for line in truth):
            twice -= 1
        elif place is None:
            like = [line for line in truth if line[0] == row[0] and line[5] == row[5]][:2]
            return [f"row {number}, {row}, was not sent there; like it: {like}"]
        else:
            rest[place] = None
            at = place + 1
    return []


def is_same(row, line, troubled):
    node, signal, value, unit, status, raw = row
    if (node, raw) != (line[0], line[5]):
        return False
    if row == line:
        return True
    return troubled and signal == line[1] and value in ("", line[2]) and unit in ("", line[3]) and status in ("", line[4])
