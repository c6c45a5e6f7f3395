"""What the program may put on the wire: nothing that could change a device that it was not to touch."""

from scenario.relay import EXTENDED, OUT, text

LSS = {"set-id", "set-bitrate"}
# These write by SDO, and nobody else does.
WRITES = {"sdo write", "pdo map", "autozero", "store", "restore", "unit", "filter", "limits", "set-id", "set-bitrate", "minmax",
          "errors", "probe", "startup"}
SPECIFIERS = {"start": 1, "stop": 2, "preop": 0x80, "reset": 0x81, "reset-comm": 0x82}
GUARDS = {"nmt", "probe", "pdo map", "store", "restore", *LSS}


def writes(scenario):
    options = scenario.arguments
    if scenario.command == "errors":
        return "--clear" in options
    if scenario.command == "minmax":
        return "--reset" in options
    return scenario.command in WRITES and "--dry-run" not in options


def commands(scenario):
    """Whether it may send NMT commands to those whom it names."""
    options = scenario.arguments
    records = scenario.command == "log" and not {"--poll", "--no-nmt", "--passive"} & set(options)
    judges = scenario.command == "check" and "--for" in options and "--poll" not in options
    return records or judges or scenario.command in {"pdo map", *LSS} or \
        scenario.command in ("store", "restore") and bool({"--verify", "--reset"} & set(options))


def is_allowed(scenario, identifier, data):
    if identifier & EXTENDED:
        return False
    number, named = identifier & 0x7FF, set(scenario.named)
    node = number & 0x7F
    if scenario.command == "log" and scenario.wanted["passive"]:
        return False
    if data is None:
        return number & 0x780 == 0x700 and node in named and scenario.command in GUARDS
    if number == 0:
        if len(data) != 2:
            return False
        if scenario.command == "nmt":
            right = data[1] == 0 if scenario.wanted["all"] else data[1] in named
            return right and data[0] == SPECIFIERS[scenario.wanted["what"]]
        return commands(scenario) and data[1] in named
    if number == 0x080:
        return "--sync" in scenario.arguments
    if number == 0x7E5:
        return scenario.command in LSS
    if number & 0x780 == 0x600 and data:
        # Uploads, aborts, and what goes on with them. Who might be where one wants to go is asked, too.
        if data[0] >> 5 in (2, 3, 4, 5):
            asks = scenario.command in LSS or scenario.command == "scan"
            everybody = scenario.command == "nmt" and scenario.wanted["all"]
            return node in named or asks or everybody
        return node in named and writes(scenario)
    return False


def judge(scenario, record):
    """The first frame that must not be, if there is one."""
    for _, direction, _, _, identifier, data in record:
        if direction == OUT and not is_allowed(scenario, identifier, data):
            return [f"touches nobody else: {text(identifier, data)}"]
    return []


def sent(record, numbers):
    """The frames of the program with these identifiers: what became of each, and its data."""
    return [(kind, data) for _, direction, kind, _, identifier, data in record if direction == OUT and identifier in numbers]
