"""The bus between the program and the devices: a relay that forwards in both directions, keeps a record and makes faults.

The relay does not receive its own frames. On the side of the program it receives only frames of the program. All other
frames are from the devices or from another master on their side.
"""

import errno
import heapq
import itertools
import os
import random
import select
import signal
import socket
import struct
import subprocess
import threading
import time

FRAME = struct.Struct("=IB3x8s")
REMOTE, EXTENDED = socket.CAN_RTR_FLAG, socket.CAN_EFF_FLAG
# The directions: sent and received by the program.
OUT, IN = "out", "in"


def can_socket(interface, own=False):
    """A raw socket for classic frames, with a large receive buffer."""
    sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, int(own))
    sock.bind((interface,))
    sock.setblocking(False)
    return sock


def pack(identifier, data):
    return FRAME.pack(identifier, len(data), bytes(data))


def unpack(raw):
    """The identifier with its flags, and the data: None for a remote frame."""
    identifier, length, data = FRAME.unpack(raw)
    return identifier, None if identifier & REMOTE else data[:length]


def text(identifier, data):
    """The frame as candump writes it."""
    number = identifier & 0x1FFFFFFF
    name = f"{number:08X}" if identifier & EXTENDED else f"{number:03X}"
    return f"{name}#{'R' if data is None else data.hex().upper()}"


class Relay(threading.Thread):
    """Forwards between the two interfaces while it is `open`, and makes the faults of a scenario.

    A fault changes a single frame: (direction, number, kind, milliseconds). Its kind is lose, double, delay, garble or
    truncate. An event is (milliseconds after the program's first frame, function, remark).
    """

    def __init__(self, here, there, program_error=None):
        super().__init__(daemon=True)
        # A simulated error of the program (see wrong_program.py), and the number of frames that it changed.
        self.program_error, self.changed_frames = program_error, 0
        self.interface = here
        self.sides = {OUT: can_socket(here), IN: can_socket(there)}
        self.rival = can_socket(there)
        self.lock = threading.Lock()
        # Locked during a fault, so that no fault happens after calm().
        self.acting = threading.Lock()
        self.ticket = itertools.count()
        self.wake_reader, self.wake_writer = os.pipe()
        self.is_open, self.is_cut, self.running = False, False, True
        self.start_record([], {}, 0, [])
        self.start()

    def start_record(self, faults, loss, seed, events):
        """Starts a new record with new faults; `loss` is the percentage of frames lost in each direction."""
        with self.lock:
            self.faults = {(direction, number): (kind, ms) for direction, number, kind, ms in faults}
            self.loss, self.random = dict(loss), random.Random(seed)
            self.events = sorted(events, key=lambda event: event[0])
            self.count = {OUT: 0, IN: 0}
            self.stalled = {OUT: 0.0, IN: 0.0}
            self.delayed = []
            self.record = []
            self.changed_frames = 0
            self.first = None
            self.is_cut = False
            # The frames that wait in the sockets are from the previous scenario.
            for side in self.sides.values():
                drain(side)

    def open(self):
        self.is_open = True

    def close(self):
        """Stops forwarding. Delayed frames are lost."""
        with self.lock:
            self.is_open, self.delayed, self.events = False, [], []

    def calm(self):
        """Ends all faults. Delayed frames are still delivered."""
        with self.acting, self.lock:
            self.faults, self.loss, self.events, self.is_cut = {}, {}, [], False

    def start_clock(self):
        """Counts the run as started even if the program has not sent a frame."""
        with self.lock:
            self.first = self.first or time.monotonic()
        os.write(self.wake_writer, b"!")

    def end(self):
        self.running = False
        os.write(self.wake_writer, b"!")
        self.join()

    def run(self):
        poller = select.poll()
        ways = {side.fileno(): direction for direction, side in self.sides.items()}
        for number in (*ways, self.wake_reader):
            poller.register(number, select.POLLIN)
        while self.running:
            for number, _ in poller.poll(self._wait()):
                if number == self.wake_reader:
                    os.read(number, 64)
                else:
                    self._read(ways[number])
            self._due()

    def _wait(self):
        with self.lock:
            due = [self.delayed[0][0]] if self.delayed else []
            if self.first and self.events:
                due.append(self.first + self.events[0][0] / 1000)
        return max(0, (min(due) - time.monotonic()) * 1000) if due else None

    def _read(self, direction):
        side = self.sides[direction]
        for _ in range(64):
            try:
                raw = side.recv(FRAME.size)
            except BlockingIOError:
                return
            except OSError as error:
                # The interface went down. The kernel reports it once, and no other frame is lost.
                if error.errno != errno.ENETDOWN:
                    raise
                continue
            identifier, data = unpack(raw)
            changed = self.program_error(direction, identifier, data) if self.program_error and self.is_open else None
            self.changed_frames += changed is not None
            with self.lock:
                for frame in [(direction, identifier, data)] if changed is None else changed:
                    self._pass(*frame)

    def _pass(self, direction, identifier, data):
        now = time.monotonic()
        if self.first is None and direction == OUT and self.is_open:
            self.first = now
        number = self.count[direction]
        self.count[direction] += 1
        kind, ms = self.faults.get((direction, number), (None, 0))
        if not self.is_open:
            kind = "closed"
        elif self.is_cut:
            kind = "cut"
        elif self.loss.get(direction) and self.random.random() * 100 < self.loss[direction]:
            kind = "lose"
        at, copies = now, 1
        sent = data
        if kind in ("lose", "cut", "closed"):
            copies = 0
        elif kind == "double":
            copies = 2
        elif kind == "delay":
            at += ms / 1000
            # Frames of the program keep their order: a slow queue delays all of them.
            if direction == OUT:
                self.stalled[OUT] = at
        elif kind == "garble":
            sent = garbled(identifier, data, ms)
        elif kind == "truncate":
            sent = truncated(identifier, data, ms)
        if sent is data and kind in ("garble", "truncate"):
            kind = None
        if direction == OUT:
            at = max(at, self.stalled[OUT])
        if kind != "closed":
            self.record.append((now, direction, kind, ms, identifier, data))
        for _ in range(copies):
            if at <= now:
                self._send(direction, identifier, sent)
            else:
                heapq.heappush(self.delayed, (at, next(self.ticket), direction, identifier, sent))

    def _send(self, direction, identifier, data):
        other = self.sides[IN if direction == OUT else OUT]
        for _ in range(1000):
            try:
                other.send(FRAME.pack(identifier, 0, b"") if data is None else pack(identifier, data))
                return
            except OSError as error:
                if error.errno == errno.ENETDOWN:
                    return
                if error.errno != errno.ENOBUFS:
                    raise
                time.sleep(0.001)

    def _due(self):
        now = time.monotonic()
        with self.lock:
            while self.delayed and self.delayed[0][0] <= now:
                self._send(*heapq.heappop(self.delayed)[2:])
        while True:
            with self.acting:
                with self.lock:
                    if not (self.first and self.events and self.first + self.events[0][0] / 1000 <= time.monotonic()):
                        return
                    _, act, remark = self.events.pop(0)
                    self.record.append((time.monotonic(), "", remark, 0, None, None))
                act()

    # The possible events.

    def cut(self, is_cut):
        self.is_cut = is_cut

    def link(self, state):
        subprocess.run(["ip", "link", "set", self.interface, state], check=True)

    def rival_sends(self, identifier, data):
        """Another master on the side of the devices: the program receives its frames and the answers."""
        self.rival.send(pack(identifier, data))

    def device_resets(self, node):
        """Simulates a power failure of a device; the program does not see the command."""
        self.sides[IN].send(pack(0, bytes([0x81, node])))

    def lines(self, last=None):
        """The record, one line for each frame."""
        first = self.record[0][0] if self.record else 0
        lines = []
        for at, direction, kind, ms, identifier, data in self.record[-last:] if last else self.record:
            if identifier is None:
                lines.append(f"{(at - first) * 1000:9.1f}  -- {kind}")
            else:
                arrow = {OUT: "->", IN: "<-"}[direction]
                fault = f"  {kind} {ms or ''}" if kind else ""
                lines.append(f"{(at - first) * 1000:9.1f}  {arrow} {text(identifier, data)}{fault}")
        return lines


def drain(sock):
    while True:
        try:
            sock.recv(FRAME.size)
        except BlockingIOError:
            return
        except OSError as error:
            if error.errno != errno.ENETDOWN:
                raise


def garbled(identifier, data, turned):
    """A changed frame that a receiver can recognise as wrong, or the same frame if that is not possible.

    Changes only command bytes and, towards the program, object addresses. No receiver could notice changed data
    bytes, and a request with another address would be a valid request."""
    number = identifier & 0x7FF
    if identifier & (REMOTE | EXTENDED) or not data:
        return data
    if 0x580 < number < 0x600 and turned % 2 and data[0] >> 5 in (2, 3) and len(data) == 8:
        place = 1 + turned % 3
        return data[:place] + bytes([data[place] ^ (turned | 0x40)]) + data[place + 1 :]
    if 0x580 < number < 0x680:
        return b"\xe0" + data[1:]
    return b"\xf7" + data[1:] if number == 0x7E4 else data


def truncated(identifier, data, length):
    """A truncated frame, if a receiver can notice it: TPDOs, and SDO answers without a complete address."""
    number = identifier & 0x7FF
    if identifier & (REMOTE | EXTENDED) or not data or not (0x180 <= number < 0x580 or 0x580 < number < 0x600):
        return data
    return data[: min(length, 3, len(data) - 1)]


def stop(process, is_stopped):
    """Stops or continues the simulator."""
    process.send_signal(signal.SIGSTOP if is_stopped else signal.SIGCONT)
