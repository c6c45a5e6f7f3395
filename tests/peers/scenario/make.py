"""Makes a scenario from a seed: a bench, faults, a command and its interruption."""

import random

from scenario import kinds
from scenario.relay import IN, OUT

UNITS = {"pressure": ("bar", "psi", "MPa", "kPa", "mbar"), "temperature": ("degC", "degF", "K")}
# Mapping entries and their replacements; fixed mappings are rejected, or already as requested.
ITEMS = {
    "mh4": {"pressure": 0x61300120, "pressure.status": 0x61500108, "temperature": 0x61300220, "0x9130:1/32": 0x91300120},
    "d20": {"0x6130:1/32": 0x61300120, "0x2090:0/32": 0x20900020},
    "dps": {"pressure": 0x61300120, "0x7100:1/16": 0x71000110},
    "mc1609": {"ch1": 0x71300110, "ch3": 0x71300310, "0x7130:2/16": 0x71300210},
    "hydac": {"rest-lifetime": 0x36010120, "0x6130:1/32": 0x61300120, "pressure.status": 0x61500108},
    "jumo": {"ch1": 0x91300120, "ch1.status": 0x61500108},
}
LSS_SERVICES = (0x11, 0x13, 0x17, 0x43, 0x4B, 0x5E)


class Scenario:
    """All data that a seed determines."""

    def __init__(self, seed):
        self.seed = seed
        rng = random.Random(seed)
        self.devices = [device(rng, place) for place in range(rng.choice((1, 1, 2, 2, 3, 4)))]
        self.command, self.arguments, self.named, self.wanted = command(rng, self)
        self.timing = (rng.choice((100, 300, 300, 500)), rng.choice((0, 1, 1, 2)))
        self.faults, self.loss, self.events, self.rival, self.signal = [], {}, [], [], None
        if rng.random() < 0.75:
            trouble(rng, self)
        if not self.is_troubled():
            # A command without faults must not fail on a slow machine.
            self.timing = (1000, 1)

    def is_troubled(self):
        oddities = any(device["lss"] or device["latency"] >= 20 for device in self.devices)
        return bool(self.faults or self.loss or self.events or self.rival or self.signal or oddities)

    def at(self, node):
        """The device with a node-ID, if there is one."""
        return next((device for device in self.devices if device["node"] == node), None)

    def kinds_of_trouble(self):
        return {fault[2] for fault in self.faults} | {event[1] for event in self.events} | \
            ({"lose"} if self.loss else set()) | {act[1] for act in self.rival}

    def is_disordered(self):
        return bool({"double", "delay", "stopped"} & self.kinds_of_trouble())

    def was_written_by_others(self, node):
        """Whether another master wrote to it (only 1017h), or a reset discarded unsaved values."""
        return self.restarts(node) or any(act == "writes" and frame[0] == 0x600 + node for _, act, frame in self.rival)

    def is_commanded_by_others(self, node=None):
        """Whether another master sends NMT commands, or a device restarts on its own."""
        commands = [frame[1][1] for _, act, frame in self.rival if act == "commands"]
        commands += [of for _, what, of in self.events if what == "power"]
        return bool(commands) if node is None else bool({0, node} & set(commands))

    def restarts(self, node):
        """Whether it restarts for a reason other than the program."""
        resets = {frame[1][1] for _, act, frame in self.rival if act == "commands" and frame[1][0] in (0x81, 0x82)}
        return bool({0, node} & (resets | {of for _, what, of in self.events if what == "power"}))

    def line(self):
        """The command line after the bus option."""
        timeout, retries = self.timing
        return ["--timeout", f"{timeout}ms", "--retries", str(retries), *self.arguments]

    def bench(self, record):
        """The bench as the simulator reads it."""
        lines = [f'record = "{record}"', f"seed = {self.seed % 1000}"]
        for device in self.devices:
            lines += ["[[device]]", f'kind = "{device["kind"]}"', f"serial = {device['serial']}"]
            lines += [f"node = {device['node']}"] if device["node"] else []
            lines += ["start = true"] if device["start"] else []
            lines += [f'latency = "{device["latency"]}ms"'] if device["latency"] else []
            objects = ", ".join(f'"0x{index:04X}:{sub}" = {value}' for (index, sub), value in device["set"].items())
            lines += [f"set = {{ {objects} }}"] if objects else []
            if device["lss"]:
                lines += ["[device.lss]", *device["lss"]]
            for channel in device["channels"]:
                lines += ["[[device.channel]]", *(f"{name} = {value}" for name, value in channel.items())]
            if device["overload"]:
                lines += ["[[device.overload]]", f"channel = {device['overload']}", 'from = "400ms"', 'until = "900ms"', 'direction = "high"']
        return "\n".join(lines) + "\n"

    def __str__(self):
        timeout, retries = self.timing
        lines = [f"seed {self.seed}: {' '.join(self.line())}"]
        lines += [f"    device {device}" for device in self.devices]
        lines += [f"    faults {self.faults} loss {self.loss} events {self.events} rival {self.rival}"]
        return "\n".join([*lines, f"    signal {self.signal}"])


def device(rng, place):
    kind = rng.choice(("mh4", "mh4", *kinds.KINDS))
    settings = {}
    if rng.random() < 0.5:
        settings[0x1017, 0] = rng.choice((50, 100, 200))
    lss = []
    if rng.random() < 0.1:
        service = rng.choice(LSS_SERVICES)
        lss = [rng.choice((f"lose = [{service}]", f'late = {{ "{service}" = "{rng.choice((60, 300, 900))}ms" }}',
                           f'refuse = {{ "{rng.choice((0x11, 0x13, 0x17))}" = 1 }}', "endless_fastscan = true"))]
    made = {
        "kind": kind,
        # No two serial numbers are equal: all differ modulo 11.
        "node": rng.choice((1, 5, 7, 33, 80)) + 11 * place,
        "serial": 1000 + place,
        "start": rng.random() < 0.2,
        "latency": rng.choice((0, 0, 0, 0, 0, 1, 1, 3, 3, 20)),
        "set": settings,
        # The value written to 1017h before the command, and not stored.
        "unsaved": rng.choice((60, 150)) if rng.random() < 0.2 else None,
        "lss": lss,
        "channels": [],
        "overload": kinds.signals(kind)[0]["channel"] if rng.random() < 0.15 else None,
    }
    if rng.random() < 0.3:
        timed(rng, made)
    return made


def timed(rng, device):
    """Makes the device send by its event timer, not at SYNC."""
    device["set"][0x1800, 5] = rng.choice((20, 50, 100))
    if device["kind"] in ("mh4", "d20"):
        device["set"][0x1800, 2] = 254


def hold_still(scenario, share=None):
    """Makes measured values constant, so that a read can be repeated. With `share`, near zero."""
    for device in scenario.devices:
        device["overload"] = None
        for channel in kinds.model(device["kind"])["channel"]:
            still = {"channel": channel["channel"], "amplitude": 0.0, "noise": 0.0}
            if share is not None:
                still["base"] = share * (channel["end"] - channel["start"])
            device["channels"].append(still)


def some(rng, scenario):
    """Existing nodes, and rarely a missing one."""
    nodes = [device["node"] for device in scenario.devices if rng.random() < 0.7] or [scenario.devices[0]["node"]]
    if rng.random() < 0.04:
        nodes.append(99)
    return sorted(set(nodes))


def listed(nodes):
    return ",".join(map(str, nodes))


def command(rng, scenario):
    """The name, the arguments, the named nodes and the requested values."""
    one = rng.choice(scenario.devices)
    node, kind = one["node"], one["kind"]
    name = rng.choice(("sdo read", "sdo write", "sdo write", "nmt", "nmt", "pdo map", "pdo map", "autozero", "store", "restore", "unit",
                       "filter", "limits", "set-id", "set-id", "set-bitrate", "log", "log", "log", "log", "read", "scan", "info", "check",
                       "minmax", "errors", "probe", "startup", "pdo show"))
    if name == "sdo read":
        thing = rng.choice(kinds.steady(kind))
        return name, ["sdo", "read", str(node), str(thing), "--format", "json"], [node], {"object": thing.at}
    if name == "sdo write":
        thing = rng.choice([thing for thing in kinds.plain(kind)])
        value = rng.choice((0, 1, 2, 50, 100, 1000))
        verify = ["--verify"] if rng.random() < 0.3 else []
        wanted = {"object": thing.at, "value": value}
        return name, ["sdo", "write", str(node), str(thing), str(value), *verify], [node], wanted
    if name == "nmt":
        what = rng.choice(("start", "stop", "preop", "reset", "reset-comm"))
        nodes = some(rng, scenario)
        all_nodes = rng.random() < 0.1
        options = rng.choice(([], [], ["--confirm"], ["--confirm"], ["--no-wait"]))
        return name, ["nmt", what, "all" if all_nodes else listed(nodes), "--format", "json", *options], \
            [device["node"] for device in scenario.devices] if all_nodes else nodes, {"what": what, "all": all_nodes}
    if name == "pdo map":
        items = rng.sample(sorted(ITEMS[kind]), rng.randint(0, min(2, len(ITEMS[kind]))))
        code = rng.choice((None, None, ("sync:1", 1), ("sync:5", 5), ("event", 255), ("254", 254)))
        timer = rng.choice((None, None, 0, 20, 1000))
        options = (["--transmission", code[0]] if code else []) + (["--event-timer", f"{timer}ms"] if timer is not None else [])
        options += ["--store"] if rng.random() < 0.3 else []
        if not items and not options:
            items = sorted(ITEMS[kind])[:1]
        pdo = rng.choice((1, 1, 1, 2))
        wanted = {"pdo": pdo, "words": [ITEMS[kind][item] for item in items] or None, "code": code and code[1], "timer": timer}
        return name, ["pdo", "map", str(node), str(pdo), *items, *options], [node], wanted
    if name == "autozero":
        hold_still(scenario, rng.choice((0.002, 0.004, -0.003, 0.2)))
        options = [option for option, odds in (("--store", 0.5), ("--force", 0.2), ("--dry-run", 0.15)) if rng.random() < odds]
        samples = ["--samples", str(rng.choice((2, 3, 5)))]
        return name, ["autozero", str(node), "--format", "json", *samples, *options], [node], {}
    if name == "store":
        one["unsaved"] = 150
        group = rng.choice(("all", "all", "comm", "app"))
        verify = ["--verify"] if rng.random() < 0.4 else []
        return name, ["store", str(node), "--group", group, *verify], [node], {"group": group}
    if name == "restore":
        one["set"].setdefault((0x1017, 0), 100)
        group = rng.choice(("all", "all", "comm", "app"))
        reset = ["--reset"] if rng.random() < 0.7 else []
        return name, ["restore", str(node), "--group", group, *reset], [node], {"group": group, "reset": bool(reset)}
    if name == "unit":
        signal = rng.choice(kinds.signals(kind))
        family = "temperature" if signal["name"] == "temperature" or kind in ("mc1609", "jumo") else "pressure"
        unit = rng.choice(UNITS[family])
        return name, ["unit", str(node), signal["name"], unit], [node], {"unit": unit, "signal": signal}
    if name == "filter":
        constant = rng.choice((1, 5, 20))
        signal = rng.choice(kinds.signals(kind))
        return name, ["filter", str(node), signal["name"], "--constant", str(constant)], [node], {"constant": constant, "signal": signal}
    if name == "limits":
        signal = rng.choice(kinds.signals(kind))
        low, high = rng.choice((0, 1, 2)), rng.choice((3, 4, 9))
        return name, ["limits", str(node), signal["name"], "--lower", str(low), "--upper", str(high)], [node], \
            {"low": low, "high": high, "signal": signal}
    if name in ("set-id", "set-bitrate"):
        return lss(rng, scenario, name, one)
    if name == "log":
        return log(rng, scenario)
    if name == "read":
        hold_still(scenario)
        nodes = some(rng, scenario)
        return name, ["read", listed(nodes), "--format", "json"], nodes, {}
    if name == "scan":
        nodes = sorted({*some(rng, scenario), *rng.sample(range(1, 128), 4)})
        return name, ["scan", listed(nodes), "--format", "json"], nodes, {}
    if name == "check":
        hold_still(scenario)
        signal = kinds.signals(kind)[0]
        base = next(c["base"] for c in kinds.model(kind)["channel"] if c["channel"] == signal["channel"])
        holds = rng.random() < 0.5
        limit = round(base * rng.choice((1.2, 1.5) if holds else (0.5, 0.8)), 2)
        how = rng.choice(([], [], ["--for", "500ms", "--poll", "50ms"], ["--for", "500ms"], ["--for", "500ms", "--sync", "20ms"]))
        return name, ["check", str(node), f"{signal['name']} < {limit}", *how], [node], {"holds": holds, "how": how}
    if name == "minmax":
        return name, ["minmax", str(node), *(["--reset"] if rng.random() < 0.7 else [])], [node], {}
    if name == "errors":
        return name, ["errors", str(node), *(["--clear"] if rng.random() < 0.5 else [])], [node], {}
    if name == "probe":
        return name, ["nmt", "state", str(node), "--probe", "--format", "json"], [node], {}
    if name == "startup":
        return name, ["nmt", "startup", str(node), rng.choice(("wait", "auto"))], [node], {}
    if name == "pdo show":
        return name, ["pdo", "show", str(node), "--format", "json"], [node], {}
    return name, ["info", str(node), "--format", "json"], [node], {}


def lss(rng, scenario, name, one):
    node, serial = one["node"], one["serial"]
    targets = [str(node)] * 3 + [None] + (["only"] if len(scenario.devices) == 1 else [])
    target = rng.choice(targets)
    if target is None and name == "set-id":
        # Found by fastscan.
        one["node"], target, node = None, "unconfigured", None
        one["set"].pop((0x1017, 0), None)
        one["unsaved"] = None
    target = target or str(node)
    options = (["--no-store"] if rng.random() < 0.2 else []) + rng.choice(([], [], ["--via", "lss"], ["--via", "sdo"]))
    if name == "set-id":
        new = rng.choice((12, 55, 127, rng.choice(scenario.devices)["node"] or 2))
        return name, ["lss", "set-id", target, str(new), "--format", "json", *options], [node, new], \
            {"new": new, "old": node, "serial": serial, "stored": "--no-store" not in options}
    return name, ["lss", "set-bitrate", target, rng.choice(("125k", "250k", "500k")), *options], [node], {}


def log(rng, scenario):
    nodes = some(rng, scenario)
    how = rng.choice(([], [], [], ["--sync", "20ms"], ["--sync", "50ms"], ["--poll", "50ms"], ["--poll", "20ms"], ["--no-nmt"], ["--passive"]))
    if not how and rng.random() < 0.8:
        for one in filter(None, map(scenario.at, nodes)):
            timed(rng, one)
    if how == ["--passive"]:
        how = how + [option for node in nodes if scenario.at(node) for option in ("--device", f"{node}={scenario.at(node)['kind']}")]
    ends = rng.choice((["--count", str(rng.choice((1, 10, 40)))], ["--duration", f"{rng.choice((300, 700, 1500))}ms"]))
    if ends[0] == "--count":
        # Without values the recording would not end.
        ends += ["--duration", "3s"]
    return "log", ["log", listed(nodes), *how, *ends], nodes, \
        {"poll": "--poll" in how, "file": rng.random() < 0.4, "passive": "--passive" in how, "count": int(ends[1]) if ends[0] == "--count" else None}


def when(rng, command):
    """A moment in milliseconds after the first frame. Early moments are more frequent, except for long commands."""
    moments = (100, 600, 1500, 2500) if command in ("log", "check") else (3, 20, 100, 600, 1500)
    return round(rng.uniform(0, rng.choice(moments)), 1)


def trouble(rng, scenario):
    nodes = [device["node"] for device in scenario.devices if device["node"]]
    kinds_of = rng.sample(("frames", "loss", "rival", "link", "stop", "power", "cut"), rng.choice((0, 1, 1, 1, 1, 2)))
    if "frames" in kinds_of:
        for _ in range(rng.randint(1, 5)):
            kind = rng.choice(("lose", "lose", "double", "delay", "garble", "truncate"))
            ms = {"delay": rng.choice((2, 10, 60, 150, 700, 1500)), "garble": rng.randint(1, 63), "truncate": rng.randint(0, 3)}.get(kind, 0)
            number = rng.randint(0, rng.choice((3, 10, 40, 120, 300)))
            scenario.faults.append((rng.choice((OUT, IN, IN)) if kind != "truncate" else IN, number, kind, ms))
    if "loss" in kinds_of:
        scenario.loss = {rng.choice((OUT, IN)): rng.choice((2, 5, 20))}
    if "rival" in kinds_of and nodes:
        for _ in range(rng.randint(1, 8)):
            node = rng.choice(nodes)
            act = rng.choices(("reads", "writes", "commands"), (6, 2, 1 if rng.random() < 0.5 else 0))[0]
            frame = {"reads": lambda: (0x600 + node, b"\x40" + rng.choice((b"\x00\x10\x00", b"\x17\x10\x00", b"\x18\x10\x04")) + bytes(4)),
                     "writes": lambda: (0x600 + node, b"\x2b\x17\x10\x00" + rng.choice((b"\x00", b"\x4d")) + bytes(3)),
                     "commands": lambda: (0, bytes([rng.choice((1, 2, 0x80, 0x81, 0x82)), rng.choice((node, node, 0))]))}[act]()
            scenario.rival.append((when(rng, scenario.command), act, frame))
    if "link" in kinds_of:
        start = when(rng, scenario.command)
        scenario.events += [(start, "down", None), (start + rng.choice((5, 100, 600)), "up", None)]
    if "stop" in kinds_of:
        start = when(rng, scenario.command)
        scenario.events += [(start, "stopped", None), (start + rng.choice((20, 150, 800, 2500)), "continued", None)]
    if "power" in kinds_of and nodes:
        scenario.events.append((when(rng, scenario.command), "power", rng.choice(nodes)))
    if "cut" in kinds_of:
        start = when(rng, scenario.command)
        scenario.events.append((start, "cut", None))
        if rng.random() < 0.6:
            scenario.events.append((start + rng.choice((5, 50, 300, 1500)), "joined", None))
    if rng.random() < 0.3:
        scenario.signal = (rng.choice(("SIGINT", "SIGTERM", "SIGKILL")), when(rng, scenario.command))
