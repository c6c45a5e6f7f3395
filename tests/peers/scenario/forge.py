"""The relay simulates a wrong program, to check that the judges notice it.

A forgery gets the direction, identifier and data of every frame, and gives the frames that go on in its
place, (direction, identifier, data), or None if it does not change the frame. None of it stands in the
record as a fault.
"""

import itertools

from scenario.relay import IN, OUT

SIGNATURES = (b"save", b"load", b"zero")


def is_download(direction, identifier, data):
    return direction == OUT and identifier & ~0x7F == 0x600 and data and data[0] >> 5 == 1


def acknowledged(direction, identifier, data, signatures):
    if is_download(direction, identifier, data) and (data[4:8] in SIGNATURES) == signatures:
        return [(IN, identifier - 0x80, b"\x60" + data[1:4] + bytes(4))]
    return None


def unwritten(direction, identifier, data):
    """A write is acknowledged without effect."""
    return acknowledged(direction, identifier, data, False)


def unsigned(direction, identifier, data):
    """A store, restore or zero is acknowledged without effect."""
    return acknowledged(direction, identifier, data, True)


def not_put_back(direction, identifier, data):
    """The command back to PRE-OPERATIONAL is missing."""
    return [] if direction == OUT and identifier == 0 and data and data[0] == 0x80 else None


def left_configuring(direction, identifier, data):
    """LSS slaves are left in configuration state."""
    return [] if direction == OUT and identifier == 0x7E5 and data and data[:2] == b"\x04\x00" else None


def is_tpdo(direction, identifier, data):
    return direction == IN and 0x180 <= identifier < 0x580 and bool(data)


def invented(direction, identifier, data):
    """A measured value that no device sent."""
    return [(direction, identifier, bytes([data[0] ^ 1]) + data[1:])] if is_tpdo(direction, identifier, data) else None


def twice(direction, identifier, data):
    """Each measured value arrives twice."""
    return 2 * [(direction, identifier, data)] if is_tpdo(direction, identifier, data) else None


def stray(direction, identifier, data, number=itertools.count()):
    """Occasionally, a start command for all nodes."""
    return [(OUT, 0, b"\x01\x00"), (direction, identifier, data)] if direction == OUT and next(number) % 20 == 7 else None


def astray(direction, identifier, data):
    """Each write also changes another object."""
    if is_download(direction, identifier, data) and data[1:4] != b"\x17\x10\x00":
        return [(OUT, identifier, b"\x2b\x17\x10\x00\x4d\x00\x00\x00"), (direction, identifier, data)]
    return None


FORGERIES = {forgery.__name__: forgery for forgery in (unwritten, unsigned, not_put_back, left_configuring, invented, twice, stray, astray)}
