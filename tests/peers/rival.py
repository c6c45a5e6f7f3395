"""Another master that reads the same nodes, with python-canopen, as fast as it can until SIGTERM.

    rival.py IFACE NODE...

It reads expedited and segmented objects in turn. Two masters on one SDO channel disturb each other, so failed reads
are counted and repeated. Prints "reading" after the first answer, and the number of successful reads at the end.
"""

import signal
import sys
import threading

import canopen
from canopen.sdo import SdoAbortedError, SdoCommunicationError

from dictionary import remote_device

OBJECTS = ((0x1018, 1), (0x1008, 0), (0x6130, 1), (0x6131, 1), (0x1000, 0))


def main():
    interface, *nodes = sys.argv[1:]
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    network = canopen.Network()
    network.connect(interface="socketcan", channel=interface)
    good = bad = 0
    try:
        remotes = [network.add_node(int(node), remote_device({})) for node in nodes]
        while not stop.is_set():
            for index, sub in OBJECTS:
                for remote in remotes:
                    remote.sdo.RESPONSE_TIMEOUT = 1
                    try:
                        remote.sdo.upload(index, sub)
                        good += 1
                    except (SdoAbortedError, SdoCommunicationError):
                        bad += 1
                    if good == 1 and bad == 0:
                        print("reading", flush=True)
    finally:
        network.disconnect()
    print(f"{good} read, {bad} disturbed")


if __name__ == "__main__":
    sys.exit(main())
