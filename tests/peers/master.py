"""Reads a measuring device with python-canopen and prints the result as JSON.

    master.py [--sync] [--values N] [--type INDEX=TYPE]... IFACE NODE...

Prints one line for each node: device type, identity, name (segmented), the NMT states that its heartbeat shows, and
unit, decimal digits and value of each channel. It also contains N values (3) of each valid TPDO.

--sync sends SYNC, for devices with synchronous TPDOs. --type 6130=INTEGER32 is for a device on which an object of
CiA 404 has a different type. The program switches the heartbeat on and restores all changed objects. If an answer is
missing or wrong, it prints a line on standard error, and the exit status is 1.
"""

import argparse
import json
import sys

import canopen
from canopen import objectdictionary as od
from canopen.sdo import SdoAbortedError

from dictionary import ANALOGUE_INPUT, remote_device

HEARTBEAT_MS = 100
# A guest kernel on a busy machine may pause for a while.
TIMEOUT = 10


def optional(read):
    """The answer of the device; None if it has no such object."""
    try:
        return read()
    except SdoAbortedError as error:
        # The object or sub-index does not exist.
        if error.code in (0x06020000, 0x06090011):
            return None
        raise


def inputs(node):
    """The CiA 404 objects of the device, by index: one value for each channel."""
    found = {}
    for _, index, _ in ANALOGUE_INPUT:
        count = optional(lambda: node.sdo[index][0].raw)
        if count is not None:
            values = [optional(lambda: node.sdo[index][n].raw) for n in range(1, count + 1)]
            found[f"{index:04X}"] = values
    return found


def expect(node, state):
    """Waits until the heartbeat shows this state."""
    for _ in range(20):
        if node.nmt.wait_for_heartbeat(TIMEOUT) == state:
            return state
    raise RuntimeError(f"node {node.id}: no heartbeat with {state}")


def receive(network, tpdo, sync):
    """The values of the TPDO's next transmission."""
    with tpdo.receive_condition:
        # The lock is held while sending, so that the answer cannot arrive before the wait starts.
        tpdo.is_received = False
        if sync and 1 <= tpdo.trans_type <= 240:
            for _ in range(tpdo.trans_type):
                network.sync.transmit()
        tpdo.receive_condition.wait(TIMEOUT)
        if not tpdo.is_received:
            raise RuntimeError(f"{tpdo.name}: no TPDO received")
        return [entry.raw for entry in tpdo.map]


def tpdos(network, node, sync, count):
    """The parameters and some values of the valid TPDOs."""
    found = []
    for number in node.tpdo:
        tpdo = node.tpdo[number]
        if optional(lambda: node.sdo[0x1800 + number - 1][1].raw) is None:
            continue
        tpdo.read()
        if not tpdo.enabled:
            continue
        comes = tpdo.event_timer or (sync and 1 <= tpdo.trans_type <= 240)
        found.append({
            "pdo": number,
            "cob_id": tpdo.cob_id,
            "transmission": tpdo.trans_type,
            "event_timer_ms": tpdo.event_timer,
            "mapping": [f"{entry.index:04X}:{entry.subindex}/{entry.length}" for entry in tpdo.map],
            "values": [receive(network, tpdo, sync) for _ in range(count if comes else 0)],
        })
    return found


def ask(network, node, sync, count):
    """All data of one node."""
    sdo = node.sdo
    answer = {
        "node": node.id,
        "device_type": sdo[0x1000].raw,
        "identity": [sdo[0x1018][n].raw for n in range(1, sdo[0x1018][0].raw + 1)],
        "name": optional(lambda: sdo[0x1008].raw),
        "inputs": inputs(node),
    }
    heartbeat = sdo[0x1017].raw
    sdo[0x1017].raw = HEARTBEAT_MS
    try:
        if sdo[0x1017].raw != HEARTBEAT_MS:
            raise RuntimeError(f"node {node.id}: 1017h does not have the written value")
        before = node.nmt.wait_for_heartbeat(TIMEOUT)
        node.nmt.state = "OPERATIONAL"
        states = [before, expect(node, "OPERATIONAL")]
        answer["tpdos"] = tpdos(network, node, sync, count)
        node.nmt.state = "PRE-OPERATIONAL"
        answer["states"] = states + [expect(node, "PRE-OPERATIONAL")]
        if before == "OPERATIONAL":
            node.nmt.state = before
    finally:
        sdo[0x1017].raw = heartbeat
    return answer


def own_type(text):
    """Parses INDEX=TYPE, for example 6130=INTEGER32."""
    index, name = text.split("=")
    return int(index, 16), getattr(od, name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sync", action="store_true")
    parser.add_argument("--values", metavar="N", type=int, default=3)
    parser.add_argument("--type", metavar="INDEX=TYPE", type=own_type, action="append", default=[])
    parser.add_argument("interface", metavar="IFACE")
    parser.add_argument("nodes", metavar="NODE", nargs="+", type=lambda text: int(text, 0))
    arguments = parser.parse_args()
    network = canopen.Network()
    network.connect(interface="socketcan", channel=arguments.interface)
    try:
        for number in arguments.nodes:
            node = network.add_node(number, remote_device(dict(arguments.type)))
            node.sdo.RESPONSE_TIMEOUT = TIMEOUT
            print(json.dumps(ask(network, node, arguments.sync, arguments.values)), flush=True)
    except (RuntimeError, canopen.SdoCommunicationError, SdoAbortedError, canopen.nmt.NmtError) as error:
        print(f"master.py: {error}", file=sys.stderr)
        return 1
    finally:
        network.disconnect()
    return 0


if __name__ == "__main__":
    sys.exit(main())
