"""Several nodes: missing nodes, nodes that answer only some requests, two nodes with one node-ID."""

import os

from device import Device, real, uint
from table import case


class Pair(Device):
    """A second device in a separate process."""

    def __init__(self, interface, node):
        super().__init__(interface, node)
        self.other = self.second(interface)

    def run(self):
        if os.fork() == 0:
            self.other.run()
        super().run()


@case("read 5,9 --format json", 7, out='"node":5,"signal":"ch1","value":1.25', err='"kind":"no-answer","exit":3')
@case("check 5,9 'ch1 < 5' --format json", 7, err='"kind":"no-answer","exit":3')
@case("sdo read 5 0x1008", out="^CASE$")
@case("read 9", 3, err="node 9")
@case("scan 5-9", out="(?m)^ *5 ")
class OneOfTwo(Device):
    """Node 5 answers, node 9 does not exist."""


@case("read all ch1", 7, out="(?m)^1 .*1.25 bar", err="node 5: .*no answer")
@case("check all 'ch1 < 100'", 7, out="(?m)^ok +1", err="node 5: .*no answer")
@case("read 1,5 ch1", 7, err="node 5: .*no answer")
@case("log all --sync 100ms --count 2", 7, out=",1,ch1,1.25,", err="node 5")
@case("store all", 7, err="node 5")
class HalfDead(Pair):
    """Node 1 has no faults; this one answers only 1000h."""

    def second(self, interface):
        device = Device(interface, 1)
        device.objects[0x1010, 0], device.objects[0x1010, 1] = b"\1", uint(1, 4)
        return device

    def request(self, data):
        if data[1:4] == b"\0\x10\0":
            super().request(data)


@case("read all ch1", 7, out="(?m)^1 .*1.25 bar", err="node 5")
@case("check all 'ch1 < 100'", 7, err="node 5")
class OnlyHeartbeat(HalfDead):
    """Node 1 has no faults; this one sends only heartbeats."""

    heartbeat_interval = 0.1

    def request(self, data):
        pass


@case("scan 5", err="two devices|bridge")
@case("read 5", 6, err="two devices|bridge", never="1.25")
@case("sdo write 5 0x1017 100 --type u16", 1, err="two devices|bridge")
@case("check 5 'ch1 < 5'", 6, never="ok ")
@case("store 5", 1, err="two devices|bridge")
class DuplicateId(Pair):
    """Two devices with one node-ID and two serial numbers."""

    def second(self, interface):
        device = Device(interface, self.node)
        device.objects[0x1018, 4] = uint(2002, 4)
        return device


@case("log 5 --sync 100ms --count 4", 6, err="two devices|bridge", never="ok,")
@case("sdo read 5 0x6130:1 --type r32", 6, err="two devices|bridge")
class DuplicateIdAndIdentity(Pair):
    """Two devices with one node-ID and equal identities; their values differ."""

    def second(self, interface):
        device = Device(interface, self.node)
        device.array(0x6130, real(7.5))
        return device


@case("read 5", out="1.25 bar", err="twice|bridge")
@case("sdo write 5 0x1017 100 --type u16", err="twice|bridge")
@case("sdo read 5 0x1017 --type u16", out="^100$")
class Repeater(Device):
    """A bridge repeats every answer."""

    def answer(self, data):
        super().answer(data)
        super().answer(data)
