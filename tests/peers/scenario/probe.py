"""Looks into the devices from their own side: what they hold, which NMT state they are in.

Plain sockets, one request at a time for every node and all nodes side by side; SDO as CiA 301 prints it.
"""

import select
import time

from scenario import kinds
from scenario.relay import can_socket, drain, pack, unpack

# The simulator answers within milliseconds; a machine that is slower is taken for silent once more.
PATIENCE = 5.0
SILENCE = 0.4
STATES = {4: "stopped", 5: "operational", 0x7F: "pre-operational"}


class Probe:
    def __init__(self, interface):
        self.socket = can_socket(interface)

    def send(self, identifier, data):
        self.socket.send(pack(identifier, data))

    def frames(self, seconds):
        """What comes until then."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if select.select([self.socket], [], [], left)[0]:
                yield unpack(self.socket.recv(16))

    def exchange(self, requests, patience=PATIENCE):
        """Sends one request for each node, {node: bytes}; the answers that have the same address."""
        drain(self.socket)
        for node, request in requests.items():
            self.send(0x600 + node, request)
        answers, missing = {}, dict(requests)
        for identifier, data in self.frames(patience):
            node = identifier - 0x580
            if node in missing and data and len(data) == 8 and data[1:4] == missing[node][1:4]:
                answers[node] = data
                del missing[node]
                if not missing:
                    break
        return answers

    def read(self, node, place, patience=PATIENCE):
        """The data bytes of a number; None where it is refused or nobody answers."""
        return value(self.exchange({node: upload(place)}, patience).get(node))

    def snapshot(self, devices):
        """What the devices hold, {node: {(index, sub): bytes}}: those that answer."""
        plans = {device["node"]: [thing.at for thing in kinds.kept(device["kind"])] for device in devices if device["node"]}
        held = {node: {} for node in plans}
        there = self.exchange({node: upload((0x1000, 0)) for node in plans}, 3 * SILENCE)
        plans = {node: places for node, places in plans.items() if node in there}
        while plans:
            step = {node: upload(places[0]) for node, places in plans.items()}
            answers = self.exchange(step)
            for node in list(plans):
                place = plans[node].pop(0)
                if node in answers:
                    held[node][place] = value(answers[node])
                # Who is silent once is not asked further.
                if not plans[node] or node not in answers:
                    del plans[node]
        return held

    def states(self, devices):
        """The NMT states, {node: name}: who answers no SDO is stopped (or away: None where it should not be)."""
        nodes = [device["node"] for device in devices if device["node"]]
        return {node: self.state(node) for node in nodes}

    def state(self, node):
        period = self.read(node, (0x1017, 0), SILENCE)
        if period is None:
            # Or slow.
            period = self.read(node, (0x1017, 0), SILENCE)
        if period is None:
            return "stopped"
        now = int.from_bytes(period[:2], "little")
        changed = not 0 < now <= 250
        if changed and self.exchange({node: b"\x2b\x17\x10\x00" + bytes([40, 0, 0, 0])}).get(node, b"\x80")[0] != 0x60:
            return None
        found = None
        for identifier, data in self.frames(PATIENCE):
            if identifier == 0x700 + node and data and data[0] & 0x7F in STATES:
                found = STATES[data[0] & 0x7F]
                break
        if changed:
            self.exchange({node: b"\x2b\x17\x10\x00" + period[:2] + bytes(2)})
        return found

    def write(self, node, place, number, width):
        request = bytes([0x23 | (4 - width) << 2]) + upload(place)[1:4] + number.to_bytes(4, "little")
        return self.exchange({node: request}).get(node, b"\x80")[0] == 0x60

    def nmt(self, specifier, node):
        self.send(0, bytes([specifier, node]))

    def reset(self, count):
        """All devices start again, as after power off and on; waits for so many boot-ups. Those that came."""
        drain(self.socket)
        self.nmt(0x81, 0)
        return self.boot_ups(count)

    def boot_ups(self, count):
        came = []
        for identifier, data in self.frames(PATIENCE if count else 0.3):
            if identifier & 0x780 == 0x700 and data == b"\x00":
                came.append(identifier & 0x7F)
                if len(came) == count:
                    break
        return came

    def configuring(self):
        """Whether any device hears LSS inquiries: whoever is in configuration state answers."""
        drain(self.socket)
        self.send(0x7E5, b"\x5e" + bytes(7))
        return [data for identifier, data in self.frames(0.1) if identifier == 0x7E4]

    def leave_configuration(self):
        self.send(0x7E5, b"\x04" + bytes(7))


def upload(place):
    index, sub = place
    return b"\x40" + index.to_bytes(2, "little") + bytes([sub]) + bytes(4)


def value(answer):
    """The bytes of an expedited answer; with no size all four."""
    if answer is None or answer[0] & 0xE2 != 0x42:
        return None
    return answer[4 : 8 - (answer[0] >> 2 & 3)] if answer[0] & 1 else answer[4:]
