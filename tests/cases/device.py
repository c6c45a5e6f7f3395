"""A small CANopen device on a raw SocketCAN socket. Needs nothing but the standard library.

The device has no faults: a CiA 404 transmitter with one channel of 1.25 bar, whose TPDO1 follows every SYNC. A
scene (see table.py) is a subclass that overrides one method.
"""

import select
import socket
import struct
import time

REMOTE = 0x40000000
# The socket module lacks this option of Linux: the time at which the kernel received a frame.
SO_TIMESTAMPNS = 35
STOPPED, OPERATIONAL, PRE_OPERATIONAL = 4, 5, 127
# SDO abort codes.
TOGGLE, UNKNOWN_COMMAND, NO_OBJECT = 0x05030000, 0x05040001, 0x06020000


def uint(value, size):
    """An unsigned integer in wire order."""
    return value.to_bytes(size, "little")


def sint(value, size):
    """A signed integer in wire order."""
    return value.to_bytes(size, "little", signed=True)


def real(value):
    """A REAL32 in wire order."""
    return struct.pack("<f", value)


class Device:
    """One node. `objects` maps (index, sub-index) to the bytes of the object."""

    heartbeat_interval = 0      # seconds
    tick_interval = 0           # seconds between two calls of tick()

    def __init__(self, interface, node):
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.socket.bind((interface,))
        self.received_at = 0.0  # when the kernel received the last frame
        self.node = node
        self.state = PRE_OPERATIONAL
        self.guard_toggle = 0
        self.reading = None     # (index, sub-index), bytes left, toggle bit
        self.writing = None     # (index, sub-index), bytes so far
        self.objects = {
            (0x1000, 0): uint(0x00020194, 4), (0x1001, 0): b"\0", (0x1008, 0): b"CASE",
            (0x1017, 0): uint(int(1000 * self.heartbeat_interval), 2),
            (0x1018, 0): b"\4", (0x1018, 1): uint(0x4321, 4), (0x1018, 2): uint(2, 4), (0x1018, 3): uint(0x10000, 4),
            (0x1018, 4): uint(1001, 4),
            (0x1800, 0): b"\5", (0x1800, 1): uint(0x180 + node, 4), (0x1800, 2): b"\1", (0x1800, 3): uint(0, 2),
            (0x1800, 5): uint(0, 2),
        }
        self.array(0x6110, uint(90, 2))
        self.array(0x6130, real(1.25))
        self.array(0x6131, uint(0x004E0000, 4))
        self.array(0x6132, b"\2")
        self.array(0x6150, b"\0")
        self.map(0x61300120, 0x61500108)
        self.change()

    def change(self):
        """Changes the objects, in a scene."""

    def array(self, index, *values):
        """Sets an object with sub-indices from 1."""
        self.objects[index, 0] = uint(len(values), 1)
        self.objects.update({(index, sub): value for sub, value in enumerate(values, 1)})

    def remove(self, first, last):
        """Removes the objects of these indices."""
        self.objects = {key: value for key, value in self.objects.items() if not first <= key[0] <= last}

    def profile(self, device_type):
        """Makes this a device of another profile, without measuring objects."""
        self.remove(0x6000, 0x9FFF)
        self.objects[0x1000, 0] = uint(device_type, 4)

    def map(self, *entries):
        """Maps TPDO1."""
        self.remove(0x1A00, 0x1A00)
        self.array(0x1A00, *(uint(entry, 4) for entry in entries))

    # Frames

    def send(self, identifier, data=b""):
        self.socket.send(struct.pack("<IB3x8s", identifier, len(data), bytes(data)))

    def answer(self, data):
        """Sends one SDO answer."""
        self.send(0x580 + self.node, data)

    def frame(self, identifier, data):
        """Handles a received frame."""
        if identifier == 0x600 + self.node:
            if self.state != STOPPED:
                self.request(data.ljust(8, b"\0"))
        elif identifier == 0 and len(data) >= 2 and data[1] in (0, self.node):
            self.command(data[0])
        elif identifier == 0x80:
            self.sync(data)
        elif identifier == 0x700 + self.node | REMOTE:
            self.send(0x700 + self.node, bytes([self.state | self.guard_toggle]))
            self.guard_toggle ^= 0x80

    def sync(self, _data):
        """After a SYNC."""
        self.send_pdo()

    def command(self, command):
        """Executes an NMT command."""
        if command in (129, 130):
            self.reset()
        else:
            self.state = {1: OPERATIONAL, 2: STOPPED, 128: PRE_OPERATIONAL}.get(command, self.state)

    def reset(self):
        self.state = PRE_OPERATIONAL
        time.sleep(0.02)
        self.send(0x700 + self.node, b"\0")

    def heartbeat(self):
        self.send(0x700 + self.node, bytes([self.state]))

    def tick(self):
        """Every `tick_interval` seconds."""

    def pdo(self):
        """The data of TPDO1."""
        data = b""
        for sub in range(1, self.objects[0x1A00, 0][0] + 1):
            bits, sub_index, index = struct.unpack("<BBH", self.objects[0x1A00, sub])
            data += self.objects[index, sub_index][:(bits & 0x7F) // 8]
        return data

    def send_pdo(self):
        if self.state == OPERATIONAL:
            self.send(0x180 + self.node, self.pdo())

    # SDO server

    def request(self, data):
        """Handles an SDO request."""
        specifier, key = data[0] >> 5, (data[1] | data[2] << 8, data[3])
        if specifier == 2:
            value = self.read(key)
            self.answer(struct.pack("<BHBI", 0x80, *key, NO_OBJECT)) if value is None else self.upload(key, value)
        elif specifier == 3 and self.reading:
            self.upload_segment(data[0] >> 4 & 1)
        elif specifier == 1 and data[0] & 2:
            size = 4 - (data[0] >> 2 & 3) if data[0] & 1 else 4
            code = self.write(key, data[4:4 + size])
            self.answer(struct.pack("<BHBI", 0x80, *key, code) if code else b"\x60" + data[1:4] + bytes(4))
        elif specifier == 1:
            self.writing = key, b""
            self.answer(b"\x60" + data[1:4] + bytes(4))
        elif specifier == 0 and self.writing:
            key, value = self.writing
            self.writing = key, value + data[1:8 - (data[0] >> 1 & 7)]
            if data[0] & 1:
                self.write(*self.writing)
                self.writing = None
            self.answer(bytes([0x20 | data[0] & 0x10]) + bytes(7))
        elif specifier == 4:
            self.reading = self.writing = None
        else:
            self.answer(struct.pack("<BHBI", 0x80, *key, UNKNOWN_COMMAND))

    def read(self, key):
        """The bytes of an object; None if it does not exist."""
        return self.objects.get(key)

    def write(self, key, value):
        """Writes an object; the abort code, or 0."""
        if key not in self.objects:
            return NO_OBJECT
        self.objects[key] = value
        return 0

    def upload(self, key, value):
        """The first answer of a read."""
        if len(value) <= 4:
            self.answer(struct.pack("<BHB", 0x43 | 4 - len(value) << 2, *key) + value.ljust(4, b"\0"))
        else:
            self.reading = key, value, 0
            self.answer(struct.pack("<BHBI", 0x41, *key, len(value)))

    def upload_segment(self, toggle):
        key, value, expected = self.reading
        if toggle != expected:
            self.answer(struct.pack("<BHBI", 0x80, *key, TOGGLE))
            self.reading = None
            return
        part, rest = value[:7], value[7:]
        self.answer(bytes([toggle << 4 | 7 - len(part) << 1 | (not rest)]) + part.ljust(7, b"\0"))
        self.reading = (key, rest, 1 - toggle) if rest else None

    # The loop

    def run(self):
        """Runs the device until its process is killed."""
        self.send(0x700 + self.node, b"\0")
        timers = [[interval, action, time.monotonic() + interval]
                  for interval, action in ((self.heartbeat_interval, self.heartbeat), (self.tick_interval, self.tick))
                  if interval]
        while True:
            now = time.monotonic()
            for timer in timers:
                if now >= timer[2]:
                    timer[2] = max(timer[2] + timer[0], now)
                    timer[1]()
            wait = min((due for *_, due in timers), default=now + 60) - time.monotonic()
            if select.select([self.socket], [], [], max(wait, 0))[0]:
                frame, [(*_, time_received)], *_ = self.socket.recvmsg(16, 64)
                seconds, nanoseconds = struct.unpack("qq", time_received)
                self.received_at = seconds + nanoseconds / 1e9
                identifier, length, data = struct.unpack("<IB3x8s", frame)
                self.frame(identifier, data[:length])
