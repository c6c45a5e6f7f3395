"""A device on a CAN bus that stores data, with the SDO server of python-canopen or durand.

    store.py {canopen|durand} --files DIR [--heartbeat MS] IFACE NODE

Its objects:

    2000h    the file DIR/2000: an upload reads it, a download replaces it
    2001h    the file DIR/2001, read-only
    2002h    UNSIGNED32
    2003h    zeros, so many that an upload exceeds every time-out
    2100h    canopen only: stores the written values, one sub-index for each of values.VALUES
    2101h    canopen only: the values of values.VALUES

For each download to 2100h, DIR/values gets a line "SUB VALUE" with the value as decoded by python-canopen. The program
prints "ready" when it has booted, and ends on SIGTERM.
"""

import argparse
import logging
import os
import signal
import sys

# python-canopen logs each request that the device rejects; these tests make many.
logging.disable(logging.CRITICAL)

HUGE = bytes(16 << 20)


class Files:
    """The objects that are files."""

    def __init__(self, directory):
        self.directory = directory

    def path(self, name):
        return os.path.join(self.directory, name)

    def read(self, index):
        with open(self.path(f"{index:04X}"), "rb") as file:
            return file.read()

    def write(self, index, data):
        # A reader never sees a partial file.
        with open(self.path("new"), "wb") as file:
            file.write(data)
        os.replace(self.path("new"), self.path(f"{index:04X}"))


def with_canopen(arguments, files):
    """python-canopen: expedited and segmented."""
    import canopen
    from canopen import objectdictionary as od

    from dictionary import channels, record, variable
    from values import VALUES

    dictionary = od.ObjectDictionary()
    for entry in [
        variable("Device type", 0x1000, 0, od.UNSIGNED32, 0, "ro"),
        variable("Error register", 0x1001, 0, od.UNSIGNED8, 0, "ro"),
        variable("Producer heartbeat time", 0x1017, 0, od.UNSIGNED16, arguments.heartbeat),
        channels("Identity", 0x1018, od.UNSIGNED32, [0x1234, 3, 1, arguments.node]),
        variable("Data", 0x2000, 0, od.DOMAIN),
        variable("Data to read", 0x2001, 0, od.DOMAIN, access="ro"),
        variable("Number", 0x2002, 0, od.UNSIGNED32, 0),
        variable("Huge", 0x2003, 0, od.DOMAIN, HUGE, access="ro"),
        record("To write", 0x2100, [(sub, entry[0], None, "rw") for sub, entry in enumerate(VALUES, start=1)]),
        record("To read", 0x2101, [(sub, entry[0], entry[2], "ro") for sub, entry in enumerate(VALUES, start=1)]),
    ]:
        dictionary.add_object(entry)
    node = canopen.LocalNode(arguments.node, dictionary)
    values = open(files.path("values"), "w", encoding="utf-8")

    def on_read(index, **_):
        return files.read(index) if index in (0x2000, 0x2001) else None

    def on_write(index, subindex, od, data):
        if index == 0x2000:
            files.write(index, data)
        elif index == 0x2100:
            print(subindex, repr(od.decode_raw(bytes(data))), file=values, flush=True)

    network = canopen.Network()
    network.connect(interface="socketcan", channel=arguments.interface)
    network.add_node(node)
    node.add_read_callback(on_read)
    node.add_write_callback(on_write)
    node.nmt.state = "INITIALISING"
    node.nmt.state = "PRE-OPERATIONAL"
    return network.disconnect


def with_durand(arguments, files):
    """durand: block transfer too."""
    import can
    from durand import CANBusNetwork, MinimalNode, Record, Variable
    from durand.datatypes import DatatypeEnum as types

    bus = can.Bus(interface="socketcan", channel=arguments.interface)
    network = CANBusNetwork(bus)
    node = MinimalNode(network, arguments.node)
    dictionary = node.object_dictionary
    dictionary[0x2000] = Variable(types.DOMAIN, "rw")
    dictionary[0x2001] = Variable(types.DOMAIN, "ro")
    dictionary[0x2002] = Variable(types.UNSIGNED32, "rw")
    dictionary[0x2003] = Variable(types.DOMAIN, "ro", HUGE)
    for index in (0x2000, 0x2001):
        dictionary.set_read_callback(index, 0, lambda index=index: files.read(index))
    dictionary.download_callbacks[(0x2000, 0)].add(lambda data: files.write(0x2000, data))

    def end():
        network.stop()
        bus.shutdown()

    return end


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("peer", choices=["canopen", "durand"])
    parser.add_argument("--files", metavar="DIR", required=True)
    parser.add_argument("--heartbeat", metavar="MS", type=int, default=0)
    parser.add_argument("interface", metavar="IFACE")
    parser.add_argument("node", metavar="NODE", type=lambda text: int(text, 0))
    arguments = parser.parse_args()

    # The main thread waits for the signals below. Threads started from here on inherit the blocking.
    ends = {signal.SIGTERM, signal.SIGINT}
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    end = {"canopen": with_canopen, "durand": with_durand}[arguments.peer](arguments, Files(arguments.files))
    try:
        print("ready", flush=True)
        signal.sigwait(ends)
    finally:
        end()


if __name__ == "__main__":
    sys.exit(main())
