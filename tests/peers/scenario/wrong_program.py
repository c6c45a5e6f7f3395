"""The relay simulates errors of the program, to check that the judges notice them.

Each function gets the direction, identifier and data of every frame. It returns the frames that replace it, as
(direction, identifier, data), or None if it does not change the frame. The record does not mark these frames as faults.
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


def write_ignored(direction, identifier, data):
    """A write is acknowledged without effect."""
    return acknowledged(direction, identifier, data, False)


def signature_ignored(direction, identifier, data):
    """A store, restore or zero is acknowledged without effect."""
    return acknowledged(direction, identifier, data, True)


def state_not_restored(direction, identifier, data):
    """The command back to PRE-OPERATIONAL is missing."""
    return [] if direction == OUT and identifier == 0 and data and data[0] == 0x80 else None


def left_in_configuration(direction, identifier, data):
    """LSS slaves are left in configuration state."""
    return [] if direction == OUT and identifier == 0x7E5 and data and data[:2] == b"\x04\x00" else None


def is_tpdo(direction, identifier, data):
    return direction == IN and 0x180 <= identifier < 0x580 and bool(data)


def invented_value(direction, identifier, data):
    """A measured value that no device sent."""
    return [(direction, identifier, bytes([data[0] ^ 1]) + data[1:])] if is_tpdo(direction, identifier, data) else None


def repeated_value(direction, identifier, data):
    """Each measured value arrives twice."""
    return 2 * [(direction, identifier, data)] if is_tpdo(direction, identifier, data) else None


def start_of_all_nodes(direction, identifier, data, number=itertools.count()):
    """Occasionally, a start command for all nodes."""
    return [(OUT, 0, b"\x01\x00"), (direction, identifier, data)] if direction == OUT and next(number) % 20 == 7 else None


def write_to_other_object(direction, identifier, data):
    """Each write also changes another object."""
    if is_download(direction, identifier, data) and data[1:4] != b"\x17\x10\x00":
        return [(OUT, identifier, b"\x2b\x17\x10\x00\x4d\x00\x00\x00"), (direction, identifier, data)]
    return None


PROGRAM_ERRORS = {error.__name__: error for error in (
    write_ignored, signature_ignored, state_not_restored, left_in_configuration, invented_value, repeated_value,
    start_of_all_nodes, write_to_other_object)}
