"""python-canopen as an independent judge of the result."""

import canopen
from canopen.sdo import SdoAbortedError, SdoCommunicationError

from scenario import kinds


class Foreign:
    """A network on the side of the devices. It is short-lived: it would accept answers to the probe as its own."""

    def __init__(self, interface):
        self.interface = interface
        # The reason of the last failed read.
        self.trouble = None

    def __enter__(self):
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=self.interface)
        return self

    def __exit__(self, *_):
        self.network.disconnect()

    def read(self, node, place, timeout=5):
        """The bytes of an object, also for text; None if the read is rejected or not answered."""
        if node not in self.network:
            self.network.add_node(canopen.RemoteNode(node, canopen.ObjectDictionary()))
        client = self.network[node].sdo
        client.RESPONSE_TIMEOUT = timeout
        try:
            return bytes(client.upload(*place))
        except (SdoAbortedError, SdoCommunicationError) as error:
            self.trouble = error
            return None

    def number(self, kind, node, place):
        raw = self.read(node, place)
        return None if raw is None else kinds.number(kind, place, raw)
