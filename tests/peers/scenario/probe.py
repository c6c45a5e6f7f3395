"""Reads the devices from their side of the relay: their values and NMT states.

Uses plain sockets and the SDO frames of CiA 301, for all nodes at the same time.
"""

import select
import time

from scenario import kinds
from scenario.relay import can_socket, drain, pack, unpack

# The simulator answers within milliseconds. A device that takes longer counts as silent.
TIMEOUT = 5.0
SILENCE = 0.3
# The number of requests sent at once.
WINDOW = 12
HEARTBEAT = (0x1017, 0)
STATES = {4: "stopped", 5: "operational", 0x7F: "pre-operational"}


class Probe:
    def __init__(self, interface):
        self.socket = can_socket(interface)

    def send(self, identifier, data):
        self.socket.send(pack(identifier, data))

    def frames(self, seconds):
        """The frames received until then."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if select.select([self.socket], [], [], left)[0]:
                yield unpack(self.socket.recv(16))

    def exchange(self, requests, timeout=TIMEOUT):
        """Sends one request for each node, {node: bytes}; the answers that have the same address."""
        return {node: answers[0] for node, answers in self.ask({node: [request] for node, request in requests.items()}, timeout).items()}

    def ask(self, requests, timeout=TIMEOUT):
        """Sends several requests for each node at once, {node: [bytes]}. Returns the answers with the same address, for
        each node that answered all of them. The servers of the simulator process them in order."""
        drain(self.socket)
        missing, answers = {}, {node: [None] * len(asked) for node, asked in requests.items()}
        for node, asked in requests.items():
            for number, request in enumerate(asked):
                self.send(0x600 + node, request)
                missing[node, request[1:4]] = number
        for identifier, data in self.frames(timeout) if missing else ():
            key = identifier - 0x580, data and data[1:4]
            if key in missing and len(data) == 8:
                answers[key[0]][missing.pop(key)] = data
                if not missing:
                    break
        return {node: found for node, found in answers.items() if None not in found}

    def snapshot(self, devices):
        """The values of the devices that answer: {node: {(index, sub): bytes}}."""
        plans = {device["node"]: [thing.at for thing in kinds.kept(device["kind"])] for device in devices if device["node"]}
        held = {node: {} for node in plans}
        there = self.exchange({node: upload((0x1000, 0)) for node in plans}, 3 * SILENCE)
        plans = {node: places for node, places in plans.items() if node in there}
        while plans := {node: places for node, places in plans.items() if places}:
            step = {node: places[:WINDOW] for node, places in plans.items()}
            answers = self.ask({node: [upload(place) for place in places] for node, places in step.items()})
            for node, places in step.items():
                # A device that does not answer once gets no further requests.
                held[node].update(zip(places, map(value, answers.get(node, ()))))
                plans[node] = plans[node][WINDOW:] if node in answers else []
        return held

    def states(self, devices):
        """The NMT states, {node: name}. A node that does not answer SDO is stopped. None if the state is unknown."""
        nodes = [device["node"] for device in devices if device["node"]]
        periods = self.exchange({node: upload(HEARTBEAT) for node in nodes}, SILENCE)
        # The node may also be slow.
        periods |= self.exchange({node: upload(HEARTBEAT) for node in nodes if node not in periods}, SILENCE)
        periods = {node: int.from_bytes(value(answer)[:2], "little") for node, answer in periods.items() if value(answer)}
        changed = {node: period for node, period in periods.items() if not 0 < period <= 100}
        self.exchange({node: download(HEARTBEAT, 25, 2) for node in changed})
        states = {node: None if node in periods else "stopped" for node in nodes}
        for identifier, data in self.frames(TIMEOUT if periods else 0):
            node = identifier - 0x700
            if node in periods and data and data[0] & 0x7F in STATES:
                states[node] = STATES[data[0] & 0x7F]
            if None not in states.values():
                break
        self.exchange({node: download(HEARTBEAT, period, 2) for node, period in changed.items()})
        return states

    def write(self, node, place, number, width):
        return self.exchange({node: download(place, number, width)}).get(node, b"\x80")[0] == 0x60

    def nmt(self, specifier, node):
        self.send(0, bytes([specifier, node]))

    def reset(self, count):
        """Restarts all devices, as power off and on does, and waits for this number of boot-ups. Returns those seen."""
        drain(self.socket)
        self.nmt(0x81, 0)
        return self.boot_ups(count)

    def boot_ups(self, count):
        booted = []
        for identifier, data in self.frames(TIMEOUT if count else 0.3):
            if identifier & 0x780 == 0x700 and data == b"\x00":
                booted.append(identifier & 0x7F)
                if len(booted) == count:
                    break
        return booted

    def configuring(self):
        """Whether a device is in LSS configuration state, so that it answers inquiries."""
        drain(self.socket)
        self.send(0x7E5, b"\x5e" + bytes(7))
        return [data for identifier, data in self.frames(0.1) if identifier == 0x7E4]

    def leave_configuration(self):
        self.send(0x7E5, b"\x04" + bytes(7))


def upload(place):
    index, sub = place
    return b"\x40" + index.to_bytes(2, "little") + bytes([sub]) + bytes(4)


def download(place, number, width):
    return bytes([0x23 | (4 - width) << 2]) + upload(place)[1:4] + number.to_bytes(4, "little")


def value(answer):
    """The bytes of an expedited answer; all four if it has no size."""
    if answer is None or answer[0] & 0xE2 != 0x42:
        return None
    return answer[4 : 8 - (answer[0] >> 2 & 3)] if answer[0] & 1 else answer[4:]
