"""The LSS master of python-canopen with simulated devices, on real SocketCAN.

    lss.py BINARY IFACE [NAME...]

Uses each LSS service of python-canopen, with devices with and without a node-ID. Some requests are rejected or not
supported.

    tests/socketcan/vcan target/peers/bin/python tests/peers/lss.py target/debug/cangauge vcan0
"""

import contextlib
import os
import queue
import sys

import canopen
from canopen.lss import LssError

from harness import GIVE_UP, run_checks

VENDOR, PRODUCT, REVISION, SERIAL = 0x5A, 0x5B, 0x5C, 0x5D
MH4 = (71, 1)
DPS = (0x362, 0x443150, 0x10000)


class Master:
    """python-canopen on one interface, and the boot-ups that it receives."""

    def __init__(self, interface):
        self.network = canopen.Network()
        self.network.connect(channel=interface, interface="socketcan")
        self.lss = self.network.lss
        # A fastscan waits for the time-out of many bits.
        self.lss.RESPONSE_TIMEOUT = 0.3
        self.boots = queue.Queue()
        for node in range(1, 128):
            self.network.subscribe(0x700 + node, self.heard)

    def heard(self, identifier, data, _):
        if data == b"\x00":
            self.boots.put(identifier - 0x700)

    def booted(self, node):
        """Waits for the boot-up of a node; no other node may boot before."""
        found = self.boots.get(timeout=GIVE_UP)
        assert found == node, f"{found} booted and not {node}"

    def identity(self):
        """The LSS address and node-ID of the slave in configuration state."""
        return tuple(self.lss.inquire_lss_address(part) for part in (VENDOR, PRODUCT, REVISION, SERIAL))

    def identity_of(self, node):
        """The LSS address, read by SDO."""
        sdo = self.network.add_node(node, canopen.ObjectDictionary()).sdo
        sdo.RESPONSE_TIMEOUT = GIVE_UP
        return tuple(int.from_bytes(sdo.upload(0x1018, sub), "little") for sub in (1, 2, 3, 4))

    def refused(self, call, *arguments):
        """Checks that a request is rejected or not answered; returns which one."""
        try:
            call(*arguments)
        except LssError as error:
            return str(error)
        raise AssertionError(f"{call.__name__}{arguments} was done")


@contextlib.contextmanager
def bench(cangauge, directory, text):
    """A master and simulated devices that were just switched on."""
    path = os.path.join(directory, "bench.toml")
    with open(path, "w", encoding="ascii") as file:
        file.write(text)
    master = Master(cangauge.interface)
    try:
        with cangauge.simulator(path, directory):
            yield master
    finally:
        master.network.disconnect()


def device(kind, node=None, **more):
    lines = [f'kind = "{kind}"'] + ([] if node is None else [f"node = {node}"])
    return "\n".join(["[[device]]", *lines, *(f"{name} = {value}" for name, value in more.items())]) + "\n"


def selectively(cangauge, directory):
    """One of two identical devices gets another node-ID and bit rate, and keeps the node-ID after a reset."""
    with bench(cangauge, directory, device("mh4", 5, serial=111) + device("mh4", 6, serial=222)) as master:
        assert {master.boots.get(timeout=GIVE_UP) for _ in range(2)} == {5, 6}
        identity = master.identity_of(6)
        assert identity[:2] == MH4 and identity[3] == 222, identity
        lss = master.lss
        other = (*identity[:3], 333)
        assert master.refused(lss.send_switch_state_selective, *other) == "No LSS response received"
        assert lss.send_switch_state_selective(*identity)
        assert master.identity() == identity
        assert lss.inquire_node_id() == 6
        assert master.refused(lss.configure_node_id, 128) == "LSS Error: 1"
        assert master.refused(lss.configure_bit_timing, 5) == "LSS Error: 1"
        lss.configure_node_id(12)
        lss.configure_bit_timing(3)
        lss.store_configuration()
        assert lss.inquire_node_id() == 6, "until the reset"
        lss.send_switch_state_global(lss.WAITING_STATE)
        master.network.send_message(0, [0x82, 6])
        master.booted(12)
        assert master.identity_of(12) == identity
        assert master.identity_of(5)[3] == 111


def by_ranges(cangauge, directory):
    """Identifies slaves by ranges, and slaves without a node-ID."""
    with bench(cangauge, directory, device("mh4", 5, serial=111) + device("mc1609")) as master:
        master.booted(5)
        vendor, product, revision, serial = master.identity_of(5)
        identify = master.lss.send_identify_remote_slave
        lowest, highest = 0, 0xFFFFFFFF
        identify(vendor, product, lowest, highest, lowest, highest)
        assert master.lss.responses.get(timeout=GIVE_UP)[0] == 0x4F
        identify(vendor, product, revision, revision, serial, serial)
        assert master.lss.responses.get(timeout=GIVE_UP)[0] == 0x4F
        # No slave has this address. The next request is answered, so no late answer is counted.
        identify(vendor, product, revision, revision, serial + 1, highest)
        master.lss.send_identify_non_configured_remote_slave()
        assert master.lss.responses.get(timeout=GIVE_UP)[0] == 0x50


def by_fastscan(cangauge, directory):
    """Finds three devices without a node-ID; a device with a node-ID is not changed."""
    serials = {2: 100, 1: 101, 3: 0x80000001}
    unconfigured = "".join(device("mh4", serial=serial) for serial in serials.values())
    with bench(cangauge, directory, device("mh4", 77, serial=99) + unconfigured) as master:
        master.booted(77)
        found = set()
        for node in (11, 12, 13):
            is_found, identity = master.lss.fast_scan()
            assert is_found, f"no device found before {node}"
            assert tuple(identity[:2]) == MH4, identity
            found.add(identity[3])
            assert tuple(identity) == master.identity()
            assert master.lss.inquire_node_id() == 255
            master.lss.configure_node_id(node)
            master.lss.store_configuration()
            master.lss.send_switch_state_global(master.lss.WAITING_STATE)
            master.booted(node)
            assert master.identity_of(node) == tuple(identity)
        assert found == set(serials.values()), found
        assert master.lss.fast_scan() == (False, None)


def what_a_device_does_not_do(cangauge, directory):
    """A DPS does not answer inquiries; another device rejects storing."""
    with bench(cangauge, directory, device("dps", 127, serial=7) + device("mh4", 5, lss="{ refuse = { 0x17 = 1 } }")) as master:
        assert {master.boots.get(timeout=GIVE_UP) for _ in range(2)} == {5, 127}
        lss = master.lss
        assert lss.send_switch_state_selective(*DPS, 7)
        assert master.refused(lss.inquire_node_id) == "No LSS response received"
        lss.configure_node_id(126)
        lss.configure_bit_timing(5)
        lss.store_configuration()
        lss.send_switch_state_global(lss.WAITING_STATE)
        assert lss.send_switch_state_selective(*master.identity_of(5))
        lss.configure_node_id(6)
        assert master.refused(lss.store_configuration) == "LSS Error: 1"
        lss.send_switch_state_global(lss.WAITING_STATE)
        master.network.send_message(0, [0x82, 5])
        master.booted(6)


def another_bit_rate(cangauge, directory):
    """The device is silent for two delays and then answers. The bit rate has no effect on this interface."""
    with bench(cangauge, directory, device("mh4", 5)) as master:
        master.booted(5)
        master.lss.send_switch_state_global(master.lss.CONFIGURATION_STATE)
        master.lss.configure_bit_timing(4)
        master.lss.activate_bit_timing(500)
        master.lss.send_switch_state_global(master.lss.WAITING_STATE)
        sdo = master.network.add_node(5, canopen.ObjectDictionary()).sdo
        sdo.RESPONSE_TIMEOUT = 0.1
        silent = 0
        while True:
            try:
                sdo.upload(0x1018, 1)
                break
            except canopen.SdoCommunicationError:
                silent += 1
                assert silent < 10 * GIVE_UP
        assert silent > 0, "not silent"


CHECKS = [selectively, by_ranges, by_fastscan, what_a_device_does_not_do, another_bit_rate]


if __name__ == "__main__":
    sys.exit(run_checks(*sys.argv[1:3], [(check, ()) for check in CHECKS], sys.argv[3:]))
