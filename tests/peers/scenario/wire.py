"""The frames that the program may send: none that could change a device outside the command."""

from scenario.relay import EXTENDED, OUT, text

LSS = {"set-id", "set-bitrate"}
# Only these commands write by SDO.
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
    """Whether the command may send NMT commands to the named nodes."""
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
        # Uploads, aborts and segments. A new node-ID is also checked for another device.
        if data[0] >> 5 in (2, 3, 4, 5):
            asks = scenario.command in LSS or scenario.command == "scan"
            all_nodes = scenario.command == "nmt" and scenario.wanted["all"]
            return node in named or asks or all_nodes
        return node in named and writes(scenario)
    return False


def judge(scenario, record):
    """The first forbidden frame, if there is one."""
    for _, direction, _, _, identifier, data in record:
        if direction == OUT and not is_allowed(scenario, identifier, data):
            return [f"frame to another node: {text(identifier, data)}"]
    return []


def sent(record, numbers):
    """The frames of the program with these identifiers: the fate and the data of each."""
    return [(kind, data) for _, direction, kind, _, identifier, data in record if direction == OUT and identifier in numbers]
