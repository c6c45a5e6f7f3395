"""Measuring devices on a CAN bus, made with python-canopen, for the tests of cangauge.

    device.py [--record FILE] [--eds FILE] [--period MS] [--sync N] [--heartbeat MS] [--quiet] IFACE NODE:KIND...

KIND is one of:

    real32      pressure in bar as REAL32 with a status byte: n * 0.25 - 100 bar
    overload    as real32, with overloads
    integer     pressure in psi as INTEGER32 with three decimal digits: n * 7 - 5000 (thousandths of psi)

In OPERATIONAL, each device sends TPDO1 every --period ms (50). With --sync N it sends TPDO1 at every N-th SYNC. The
program prints "ready" when all devices have booted, and ends on SIGTERM.

n counts the values of a node from 0 since the start of this program, and wraps at 4096. Of eight values of "overload",
the 5th is NaN with the status "positive overload" and the 6th is NaN with "negative overload". The 7th is a number with
the status "invalid". --record writes "NODE,N,VALUE,STATUS" before each TPDO, with the value and status of the PDO.

--eds writes the EDS file that python-canopen generates for the last node.

2000h and 2001h are manufacturer-specific objects: UNSIGNED16 and a text.
"""

import argparse
import logging
import math
import signal
import sys
import threading
import time

import canopen
from canopen import objectdictionary as od

from dictionary import channels, record, variable

BAR, PSI = 0x004E0000, 0x00AB0000
WRAP = 4096


class Kind:
    """The differences between the kinds of devices."""

    def __init__(self, name, index, bits, product, unit, digits, value, status=lambda n: 0):
        self.name, self.index, self.bits, self.product = name, index, bits, product
        self.unit, self.digits, self.value, self.status = unit, digits, value, status

    def physical(self, number):
        """The value in the unit of the device."""
        value = self.value(number)
        return value if self.index == 0x6130 else value / 10**self.digits


KINDS = {
    "real32": Kind("python-canopen pressure transmitter", 0x6130, 32, 1, BAR, 2, lambda n: n * 0.25 - 100),
    "integer": Kind("python-canopen pressure switch", 0x9130, 32, 2, PSI, 3, lambda n: n * 7 - 5000),
    "overload": Kind(
        "python-canopen overloaded transmitter", 0x6130, 32, 3, BAR, 2,
        lambda n: math.nan if n % 8 in (5, 6) else n * 0.25 - 100,
        # CiA 404: bit 0 not valid, bit 1 positive overload, bit 2 negative overload.
        lambda n: {5: 0b011, 6: 0b101, 7: 0b001}.get(n % 8, 0),
    ),
}


def dictionary(kind, node, arguments):
    """The object dictionary of a device."""
    sync = 1 <= arguments.sync <= 240
    mapping = [kind.index << 16 | 1 << 8 | kind.bits] + ([0x61500108] if kind.index == 0x6130 else [])
    result = od.ObjectDictionary()
    for entry in [
        # Profile 404, additional information: analogue inputs.
        variable("Device type", 0x1000, 0, od.UNSIGNED32, 0x00020194, "ro"),
        variable("Error register", 0x1001, 0, od.UNSIGNED8, 0, "ro"),
        variable("COB-ID SYNC", 0x1005, 0, od.UNSIGNED32, 0x80),
        # More than four bytes: segmented.
        variable("Device name", 0x1008, 0, od.VISIBLE_STRING, kind.name, "const"),
        variable("Hardware version", 0x1009, 0, od.VISIBLE_STRING, "A", "const"),
        variable("Software version", 0x100A, 0, od.VISIBLE_STRING, canopen.__version__, "const"),
        variable("Producer heartbeat time", 0x1017, 0, od.UNSIGNED16, arguments.heartbeat),
        channels("Identity", 0x1018, od.UNSIGNED32, [0x1234, kind.product, 0x00020004, 1000 + node]),
        record("TPDO 1 parameters", 0x1800, [
            (0, od.UNSIGNED8, 5, "const"),
            (1, od.UNSIGNED32, 0x40000180 + node, "rw"),
            (2, od.UNSIGNED8, arguments.sync if sync else 254, "rw"),
            (3, od.UNSIGNED16, 0, "rw"),
            (5, od.UNSIGNED16, 0 if sync else arguments.period, "rw"),
        ]),
        record("TPDO 1 mapping", 0x1A00, [(0, od.UNSIGNED8, len(mapping), "rw")]
               + [(n, od.UNSIGNED32, entry, "rw") for n, entry in enumerate(mapping + [0, 0], start=1)]),
        channels("AI sensor type", 0x6110, od.UNSIGNED16, [90]),
        channels("AI input PV REAL32", 0x6130, od.REAL32, [kind.physical(0)]),
        channels("AI physical unit", 0x6131, od.UNSIGNED32, [kind.unit]),
        channels("AI decimal digits", 0x6132, od.UNSIGNED8, [kind.digits], "rw"),
        channels("AI status", 0x6150, od.UNSIGNED8, [kind.status(0)]),
        channels("AI input PV INTEGER32", 0x9130, od.INTEGER32, [round(kind.physical(0) * 10**kind.digits)]),
        variable("A maker's number", 0x2000, 0, od.UNSIGNED16, 0xBEEF),
        variable("A maker's text", 0x2001, 0, od.VISIBLE_STRING, "as delivered"),
    ]:
        result.add_object(entry)
    return result


class Device:
    """One node: the parts that LocalNode of python-canopen does not implement."""

    def __init__(self, network, node, kind, arguments, log):
        self.kind, self.log = kind, log
        self.node = canopen.LocalNode(node, dictionary(kind, node, arguments))
        self.lock = threading.RLock()
        self.number = 0
        self.syncs = 0
        self.configured = False
        network.add_node(self.node)
        self.node.add_read_callback(self.on_read)
        self.node.add_write_callback(self.on_write)
        network.subscribe(0x000, self.on_nmt)
        network.subscribe(0x080, self.on_sync)

    def boot(self):
        """Sends the boot-up message and becomes pre-operational; the heartbeat starts."""
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def on_nmt(self, _can_id, data, _timestamp):
        # LocalNode only records the reset.
        if len(data) >= 2 and data[0] in (129, 130) and data[1] in (0, self.node.id):
            with self.lock:
                self.node.data_store.clear()
                self.configured = False
                self.syncs = 0
            self.boot()

    def on_read(self, index, subindex, **_):
        with self.lock:
            if subindex == 1 and index == 0x6130:
                return self.kind.physical(self.number)
            if subindex == 1 and index == 0x6150:
                return self.kind.status(self.number)
            if subindex == 1 and index == 0x9130:
                return round(self.kind.physical(self.number) * 10**self.kind.digits)
        return None

    def on_write(self, index, **_):
        if 0x1800 <= index < 0x1B00:
            self.configured = False

    def tpdo(self):
        """TPDO 1 with its present parameters."""
        tpdo = self.node.tpdo[1]
        if not self.configured:
            self.configured = True
            # Reading subscribes to the COB-ID, which this device itself sends.
            try:
                tpdo.read()
            except KeyError:
                # The mapping has a missing object or too many entries: nothing is sent until it is changed.
                tpdo.enabled = False
            if tpdo.enabled:
                self.node.network.unsubscribe(tpdo.cob_id)
        return tpdo

    def transmit(self, tpdo):
        """Sends TPDO 1 with the next value."""
        value, status = self.kind.value(self.number), ""
        for entry in tpdo.map:
            if entry.index == self.kind.index:
                entry.raw = value
            else:
                entry.raw = status = self.node.sdo[entry.index][entry.subindex].raw
        if self.log:
            print(self.node.id, self.number, value, status, sep=",", file=self.log, flush=True)
        tpdo.transmit()
        self.number = (self.number + 1) % WRAP

    def on_sync(self, _can_id, _data, _timestamp):
        with self.lock:
            tpdo = self.tpdo()
            if self.node.nmt.state == "OPERATIONAL" and tpdo.enabled and 1 <= tpdo.trans_type <= 240:
                self.syncs += 1
                if self.syncs % tpdo.trans_type == 0:
                    self.transmit(tpdo)

    def tick(self):
        """Sends if the event timer has expired. Returns the time until the next call."""
        with self.lock:
            tpdo = self.tpdo()
            if self.node.nmt.state != "OPERATIONAL" or not tpdo.enabled or tpdo.trans_type < 254 or not tpdo.event_timer:
                return 0.01
            self.transmit(tpdo)
            return tpdo.event_timer / 1000


def run_timer(device, stop):
    """The event timer of a device, without drift."""
    due = time.monotonic()
    while not stop.wait(max(0, due - time.monotonic())):
        due = max(due, time.monotonic() - 1) + device.tick()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", metavar="FILE")
    parser.add_argument("--eds", metavar="FILE")
    parser.add_argument("--period", metavar="MS", type=int, default=50)
    parser.add_argument("--sync", metavar="N", type=int, default=0)
    parser.add_argument("--heartbeat", metavar="MS", type=int, default=0)
    parser.add_argument("--quiet", action="store_true", help="no word about frames that make no sense")
    parser.add_argument("interface", metavar="IFACE")
    parser.add_argument("nodes", metavar="NODE:KIND", nargs="+")
    arguments = parser.parse_args()

    if arguments.quiet:
        logging.disable()
    # The main thread waits for the signals below. Threads started from here on inherit the blocking.
    ends = {signal.SIGTERM, signal.SIGINT}
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    log = open(arguments.record, "w", encoding="ascii") if arguments.record else None
    network = canopen.Network()
    # Only the identifiers of the nodes: Python is too slow for all frames of a busy bus.
    own = [0x000, 0x080] + [0x600 + int(text.split(":")[0], 0) for text in arguments.nodes]
    filters = [{"can_id": identifier, "can_mask": 0x7FF, "extended": False} for identifier in own]
    network.connect(interface="socketcan", channel=arguments.interface, can_filters=filters)
    stop = threading.Event()
    try:
        devices = []
        for text in arguments.nodes:
            node, kind = text.split(":")
            devices.append(Device(network, int(node, 0), KINDS[kind], arguments, log))
        if arguments.eds:
            canopen.export_od(devices[-1].node.object_dictionary, arguments.eds)
        timers = [threading.Thread(target=run_timer, args=(device, stop)) for device in devices]
        for device in devices:
            device.boot()
        for timer in timers:
            timer.start()
        print("ready", flush=True)
        signal.sigwait(ends)
        stop.set()
        for timer in timers:
            timer.join()
        for device in devices:
            device.node.nmt.stop_heartbeat()
    finally:
        stop.set()
        network.disconnect()
        if log:
            log.close()


if __name__ == "__main__":
    sys.exit(main())
