"""python-canopen as the judge of what was asked for."""

import canopen
from canopen.sdo import SdoAbortedError, SdoCommunicationError

from scenario import kinds


class Foreign:
    """A network on the devices' side, for a while: it would take the answers to the probe for its own."""

    def __init__(self, interface):
        self.interface = interface
        # Why the last read failed that did.
        self.trouble = None

    def __enter__(self):
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=self.interface)
        return self

    def __exit__(self, *_):
        self.network.disconnect()

    def read(self, node, place, patience=5):
        """The bytes of an object, text too; None where it is refused or nobody answers."""
        if node not in self.network:
            self.network.add_node(canopen.RemoteNode(node, canopen.ObjectDictionary()))
        client = self.network[node].sdo
        client.RESPONSE_TIMEOUT = patience
        try:
            return bytes(client.upload(*place))
        except (SdoAbortedError, SdoCommunicationError) as error:
            self.trouble = error
            return None

    def number(self, kind, node, place):
        raw = self.read(node, place)
        return None if raw is None else kinds.number(kind, place, raw)
