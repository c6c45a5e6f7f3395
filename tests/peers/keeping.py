"""autozero, store and restore: python-canopen as master of simulated devices, and as device for cangauge."""

import contextlib
import struct
import threading

import canopen
from canopen import objectdictionary as od

from dictionary import channels, record, remote_device, variable
from harness import GIVE_UP, PATIENT

STORE, RESTORE, AUTOZERO, OFFSET, PV = 0x1010, 0x1011, 0x6125, 0x6127, 0x6130
UNZEROED = 0.0625


@contextlib.contextmanager
def network(interface):
    """A python-canopen network on the interface."""
    network = canopen.Network()
    network.connect(interface="socketcan", channel=interface)
    try:
        yield network
    finally:
        network.disconnect()


def asked(interface, work):
    """Reads from node 5 with python-canopen. Each call opens a connection, because a connection that stays open would
    take answers for cangauge as its own answers."""
    with network(interface) as bus:
        node = bus.add_node(5, remote_device({}))
        node.sdo.RESPONSE_TIMEOUT = GIVE_UP
        return work(node)


def python_master_stores_and_restores(cangauge, directory):
    """Settings that python-canopen stores remain after a reset, and are lost after a restore."""
    def ask(work):
        return asked(cangauge.interface, work)

    def set_both(node):
        node.sdo[0x1017].raw = 300
        node.sdo[0x6132][1].raw = 1

    def after_reset():
        cangauge.run(*PATIENT, "nmt", "reset", 5)
        return ask(lambda node: (node.sdo[0x1017].raw, node.sdo[0x6132][1].raw))

    with cangauge.simulator("mh4@5", directory) as simulator:
        ask(lambda node: (set_both(node), node.store(2)))
        assert after_reset() == (300, 3), "communication only"
        ask(lambda node: (set_both(node), node.store()))
        assert after_reset() == (300, 1)
        ask(lambda node: node.restore(3))
        assert after_reset() == (300, 3), "application only"
        ask(lambda node: node.restore())
        assert ask(lambda node: node.sdo[0x1017].raw) == 300, "before the reset"
        assert after_reset() == (0, 3)
        # python-canopen sets a zero offset; cangauge stores and verifies it.
        ask(lambda node: node.sdo.download(AUTOZERO, 1, b"zero"))
        offset = ask(lambda node: node.sdo.upload(OFFSET, 1))
        assert struct.unpack("<f", offset)[0] < 0, offset
        assert cangauge.run(*PATIENT, "store", 5, "--verify").out == "5  all  reset\n"
        after_reset()
        assert ask(lambda node: node.sdo.upload(OFFSET, 1)) == offset
        # In the other direction, cangauge restores and python-canopen reads.
        assert cangauge.run(*PATIENT, "restore", 5, "--reset").out == "5  all  reset\n"
        assert ask(lambda node: node.sdo.upload(OFFSET, 1)) == bytes(4)
        simulator.finish()


class Transmitter:
    """A python-canopen pressure transmitter with a zero offset and a list of the received signatures."""

    def __init__(self, bus):
        dictionary = od.ObjectDictionary()
        for entry in [
            variable("Device type", 0x1000, 0, od.UNSIGNED32, 0x00020194, "ro"),
            variable("Error register", 0x1001, 0, od.UNSIGNED8, 0, "ro"),
            channels("Store", STORE, od.UNSIGNED32, [1], "rw"),
            channels("Restore", RESTORE, od.UNSIGNED32, [1], "rw"),
            variable("Producer heartbeat time", 0x1017, 0, od.UNSIGNED16, 0),
            channels("Identity", 0x1018, od.UNSIGNED32, [0x1234, 1, 1, 1]),
            record("Autozero", AUTOZERO, [(1, od.UNSIGNED32, None, "wo")]),
            channels("Offset", OFFSET, od.REAL32, [0.0], "rw"),
            channels("PV", PV, od.REAL32, [UNZEROED]),
            channels("Unit", 0x6131, od.UNSIGNED32, [0x004E0000], "rw"),
            channels("Span start", 0x6148, od.REAL32, [0.0]),
            channels("Span end", 0x6149, od.REAL32, [10.0]),
        ]:
            dictionary.add_object(entry)
        self.signatures, self.lock, self.offset = [], threading.Lock(), 0.0
        self.node = bus.add_node(canopen.LocalNode(5, dictionary))
        self.node.add_write_callback(self.written)
        self.node.add_read_callback(self.read)
        self.boot()
        bus.subscribe(0, self.commanded)

    def boot(self):
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def commanded(self, _, data, __):
        # python-canopen itself only records the reset and sends no boot-up.
        if bytes(data) in (b"\x81\x05", b"\x81\x00"):
            self.boot()

    def written(self, index, subindex, od, data):
        with self.lock:
            if index in (STORE, RESTORE, AUTOZERO):
                self.signatures.append((index, subindex, bytes(data)))
            if index == AUTOZERO and bytes(data) == b"zero":
                self.offset = -UNZEROED
            if index == OFFSET:
                self.offset = struct.unpack("<f", bytes(data))[0]

    def read(self, index, subindex, od):
        if subindex == 0:
            return None
        with self.lock:
            shown = {STORE: 1, RESTORE: 1, OFFSET: self.offset, PV: UNZEROED + self.offset}
            return shown.get(index)

    def take(self):
        """The signatures since the previous call."""
        with self.lock:
            taken, self.signatures = self.signatures, []
            return taken


def python_device_is_zeroed_and_stores(cangauge, directory):
    """A python-canopen device understands the writes of cangauge, and receives each signature once."""
    with network(cangauge.interface) as bus:
        device = Transmitter(bus)
        done = cangauge.run(*PATIENT, "autozero", 5, "--samples", 2, "--format", "json")
        [report] = done.json()
        assert [note["code"] for note in report.pop("notes")] == ["undo", "not-stored"], done
        assert report == {"node": 5, "channel": 1, "signal": "ch1", "unit": "bar", "before": UNZEROED, "after": 0.0,
                          "offset_before": 0.0, "offset": -UNZEROED, "stored": False}, done
        assert device.take() == [(AUTOZERO, 1, b"zero")]
        # The printed command undoes it.
        undo = next(line.split("undo: cangauge ")[1] for line in done.err.splitlines() if "undo" in line)
        cangauge.run(*PATIENT, *undo.split())
        assert device.offset == 0.0
        # It has no separate group "application": all settings are stored.
        done = cangauge.run(*PATIENT, "autozero", 5, "--samples", 2, "--store", "--format", "json")
        assert done.json()[0]["stored"] is True, done
        assert device.take() == [(AUTOZERO, 1, b"zero"), (STORE, 1, b"save")]
        assert cangauge.run(*PATIENT, "store", 5, "--verify").out == "5  all  reset\n"
        assert cangauge.run(*PATIENT, "restore", 5).out == "5  all  ack\n"
        assert device.take() == [(STORE, 1, b"save"), (RESTORE, 1, b"load")]
        cangauge.run(*PATIENT, "store", 5, "--group", "comm", exit=4)
        assert device.take() == []


CHECKS = [python_master_stores_and_restores, python_device_is_zeroed_and_stores]
