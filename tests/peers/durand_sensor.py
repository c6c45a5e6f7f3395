"""A pressure transmitter made with durand, for the tests of cangauge.

    durand_sensor.py [--eds FILE] IFACE NODE

All services are those of durand: SDO with block transfer, TPDOs with dynamic mapping, SYNC, heartbeat, EMCY, LSS. The
program has the objects of a transmitter of CiA 404 and a mapping for TPDO 1. --eds writes the EDS file that durand
generates. The program prints "ready" when it has booted, and ends on SIGTERM.
"""

import argparse
import asyncio
import signal

import can
from durand import CANBusNetwork, MinimalNode, Record, Variable
from durand.datatypes import DatatypeEnum as types

# Each value: index, type, access, value.
OBJECTS = [
    (0x6110, types.UNSIGNED16, "ro", 90),
    (0x6130, types.REAL32, "ro", 1.5),
    (0x6131, types.UNSIGNED32, "ro", 0x004E0000),
    (0x6132, types.UNSIGNED8, "rw", 3),
    (0x6150, types.UNSIGNED8, "ro", 0),
]
IDENTITY = [0x1234, 4, 1]


def sensor(network, id):
    """The node with its objects."""
    node = MinimalNode(network, id)
    dictionary = node.object_dictionary
    dictionary.write(0x1000, 0, 0x00020194)
    dictionary.write(0x1008, 0, b"durand pressure transmitter")
    for sub, number in enumerate([*IDENTITY, id], start=1):
        dictionary.write(0x1018, sub, number)
    for index, data_type, access, value in OBJECTS:
        record = Record(name=f"Object {index:04X}h")
        record[1] = Variable(data_type, access, value, name=f"Channel 1 of {index:04X}h")
        dictionary[index] = record
    node.tpdo[0].mapping = [(0x6130, 1), (0x6150, 1)]
    return node


async def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--eds", metavar="FILE")
    parser.add_argument("interface", metavar="IFACE")
    parser.add_argument("node", metavar="NODE", type=lambda text: int(text, 0))
    arguments = parser.parse_args()

    # The timers of durand run in the loop. The frames must arrive there, too.
    loop, end = asyncio.get_running_loop(), asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, end.set)
    bus = can.Bus(interface="socketcan", channel=arguments.interface)
    network = CANBusNetwork(bus, loop)
    try:
        node = sensor(network, arguments.node)
        if arguments.eds:
            with open(arguments.eds, "w", encoding="utf-8") as file:
                file.write(node.eds.content)
        print("ready", flush=True)
        await end.wait()
    finally:
        network.stop()
        bus.shutdown()


if __name__ == "__main__":
    asyncio.run(main())
