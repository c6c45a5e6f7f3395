"""The objects of the simulated devices, from the description files, for the judges."""

import functools
import os
import struct
import tomllib

from harness import HERE

KINDS = ("mh4", "d20", "dps", "mc1609", "hydac", "jumo")
WIDTHS = {"u8": 1, "i8": 1, "b": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "r32": 4}
# Objects that change on their own, or that start an action when written.
UNSTEADY = {0x1003, 0x1010, 0x1011}


class Object:
    def __init__(self, index, sub, entry):
        self.index, self.sub, self.type, self.access = index, sub, entry["type"], entry["access"]
        self.default, self.is_plain = entry.get("default"), "signature" not in entry

    @property
    def at(self):
        return self.index, self.sub

    @property
    def width(self):
        return WIDTHS.get(self.type)

    def __str__(self):
        return f"0x{self.index:04X}:{self.sub}"


@functools.cache
def description(kind):
    with open(os.path.join(HERE, "../../src/device/devices", f"{kind}.toml"), "rb") as file:
        return tomllib.load(file)


@functools.cache
def model(kind):
    """The data of a device kind that only the simulator has."""
    with open(os.path.join(HERE, "../../src/sim/models", f"{kind}.toml"), "rb") as file:
        return tomllib.load(file)


@functools.cache
def objects(kind):
    """All objects of a device kind, by (index, sub)."""
    found = {}
    for entry in description(kind)["object"]:
        index, _, subs = entry["at"].partition(":")
        first, _, last = (subs or "0").partition("-")
        for sub in range(int(first), int(last or first) + 1):
            thing = Object(int(index, 16), sub, entry)
            found[thing.at] = thing
    return found


@functools.cache
def kept(kind):
    """The objects that keep a written value: numbers only."""
    return [thing for thing in objects(kind).values()
            if thing.access == "rw" and thing.is_plain and thing.width and thing.index not in UNSTEADY]


@functools.cache
def plain(kind):
    """The objects of `kept` that accept any number."""
    meaning = {0x125, 0x131, 0x132, 0x1A0}
    return [thing for thing in kept(kind) if thing.type in ("u8", "u16", "u32") and thing.index & 0xFFF not in meaning
            and thing.index != 0x1014 and not 0x1800 <= thing.index < 0x6000]


@functools.cache
def steady(kind):
    """The readable objects with constant values."""
    return [thing for thing in objects(kind).values() if thing.access == "const" or thing.access == "ro" and thing.index < 0x1003
            and thing.index != 0x1001 or thing in kept(kind)]


def signals(kind):
    return description(kind)["signal"]


def at(text):
    """(index, sub) of 0x6130:1."""
    index, _, sub = text.partition(":")
    return int(index, 16), int(sub or "0")


def number(kind, place, raw):
    """The unscaled value of the bytes of an object."""
    thing = objects(kind)[place]
    raw = raw[: thing.width]
    if thing.type == "r32":
        return struct.unpack("<f", raw)[0]
    return int.from_bytes(raw, "little", signed=thing.type.startswith("i"))
