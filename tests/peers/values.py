"""Values of each data type, in python-canopen and in cangauge.

python-canopen handles TIME_OF_DAY and TIME_DIFFERENCE as bytes. This module encodes them by CiA 301, 7.1.6.5 and
7.1.6.6: milliseconds (28 bits), then days (16 bits).
"""

import datetime
import struct

from canopen import objectdictionary as od
from canopen.objectdictionary import datatypes


def time(days, milliseconds):
    return struct.pack("<IH", milliseconds, days)


# Days are counted from 1984-01-01.
LEAP_DAY = (datetime.date(2024, 2, 29) - datetime.date(1984, 1, 1)).days


def real32(number):
    """The REAL32 nearest to a number."""
    return struct.unpack("<f", struct.pack("<f", number))[0]


def integers():
    """The limits, zero and a middle value of each width."""
    for bits in range(8, 65, 8):
        low, high = -(1 << bits - 1), (1 << bits - 1) - 1
        for sign, name, values in (("u", "UNSIGNED", (0, 1, 0x5A, 2 * high + 1)), ("i", "INTEGER", (low, -1, 0, high))):
            code = getattr(datatypes, f"{name}{bits}")
            for value in values:
                yield code, f"{sign}{bits}", value, str(value)


# The type, its name in cangauge, the value in Python, the text in cangauge.
VALUES = [
    (od.BOOLEAN, "b", True, "1"),
    (od.BOOLEAN, "b", False, "0"),
    *integers(),
    (od.REAL32, "r32", 0.0, "0"),
    (od.REAL32, "r32", -2.5, "-2.5"),
    (od.REAL32, "r32", real32(0.1), "0.1"),
    (od.REAL32, "r32", real32(16777216), "16777216"),
    (od.REAL32, "r32", real32(1.2345679), "1.2345679"),
    (od.REAL64, "r64", 0.1, "0.1"),
    (od.REAL64, "r64", -123456.789, "-123456.789"),
    (od.REAL64, "r64", 1 / 3, "0.3333333333333333"),
    (od.VISIBLE_STRING, "vs", "a", "a"),
    (od.VISIBLE_STRING, "vs", "seven__", "seven__"),
    (od.VISIBLE_STRING, "vs", "text with blanks, and of some length", "text with blanks, and of some length"),
    (od.OCTET_STRING, "os", b"\x00", "00"),
    (od.OCTET_STRING, "os", bytes(range(0xF0, 0x100)), bytes(range(0xF0, 0x100)).hex(" ").upper()),
    (od.UNICODE_STRING, "us", "Öl", "Öl"),
    (od.UNICODE_STRING, "us", "Überdruck ≥ 10 µbar", "Überdruck ≥ 10 µbar"),
    (od.DOMAIN, "d", b"\x01\x02\x03", "01 02 03"),
    (od.DOMAIN, "d", bytes(range(100)), bytes(range(100)).hex(" ").upper()),
    (od.TIME_OF_DAY, "t", time(0, 0), "1984-01-01T00:00:00.000Z"),
    (od.TIME_OF_DAY, "t", time(LEAP_DAY, 45296789), "2024-02-29T12:34:56.789Z"),
    (od.TIME_DIFFERENCE, "td", time(0, 1500), "1s 500ms"),
    (od.TIME_DIFFERENCE, "td", time(2, 3 * 3600000 + 4), "2days 3h 4ms"),
]
