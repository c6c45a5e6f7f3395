"""Silent devices, lost nodes, and heartbeats and TPDOs that differ from the standard."""

from device import OPERATIONAL, PRE_OPERATIONAL, STOPPED, Device, sint, uint
from table import case

SYNC = "log 5 --sync 100ms --duration 2s"


@case("log 5 --sync 100ms --duration 3s", 3, err=("pre-operational again", "FF00h"), never="event timer")
class FallsBack(Device):
    """Returns to PRE-OPERATIONAL at once, with the emergency FF00h."""

    heartbeat_interval = 0.2

    def command(self, command):
        super().command(command)
        if self.state == OPERATIONAL:
            self.state = PRE_OPERATIONAL
            self.send(0x80 + self.node, b"\x00\xff\x81\0\0\0\0\0")


@case("log 5 --sync 100ms --duration 3s", 3, err="stopped", never="event timer")
class StopsItself(Device):
    """Stops when it is started, without emergency."""

    heartbeat_interval = 0.2

    def command(self, command):
        super().command(command)
        if self.state == OPERATIONAL:
            self.state = STOPPED


@case("log 5 --sync 50ms --count 3", rows=3)
class SyncCounter(Device):
    """1019h is 10: no TPDO after a SYNC without counter."""

    def change(self):
        self.objects[0x1005, 0], self.objects[0x1019, 0] = uint(0x80, 4), uint(10, 1)

    def sync(self, data):
        if len(data) == 1:
            self.send_pdo()


@case("log 5 --sync 50ms --count 3", rows=3)
class SyncOfAnotherIdentifier(Device):
    """1005h is 0x91."""

    def change(self):
        self.objects[0x1005, 0] = uint(0x91, 4)

    def frame(self, identifier, data):
        super().frame(0x80 if identifier == 0x91 else -1 if identifier == 0x80 else identifier, data)


class OnChange(Device):
    """Type 255 with a constant value: one TPDO after the start."""

    def change(self):
        self.objects[0x1800, 2] = b"\xff"

    def sync(self, _data):
        pass

    def command(self, command):
        before = self.state
        super().command(command)
        if self.state == OPERATIONAL != before:
            self.send_pdo()


@case("log 5 --duration 3s", rows=1, never="lost")
class Steady(OnChange):
    """Only heartbeats follow."""

    heartbeat_interval = 0.2


@case("log 5 --duration 3s", 3, rows=1, err="lost")
class HeartbeatStops(OnChange):
    """The heartbeats stop after 10."""

    heartbeat_interval = 0.1
    beats = 0

    def heartbeat(self):
        self.beats += self.state == OPERATIONAL
        if self.beats < 10:
            super().heartbeat()

    def request(self, data):
        if self.beats < 10:
            super().request(data)


@case("nmt start 5", out="operational.*heartbeat")
@case("scan --passive", out="(?m)^ *5 +operational")
@case("log 5 --sync 100ms --duration 2s", out=",1.25,bar,ok", err="8 bytes", never="lost")
class LongHeartbeat(Device):
    """Heartbeats have eight bytes."""

    heartbeat_interval = 0.2

    def heartbeat(self):
        self.send(0x700 + self.node, bytes([self.state]) + bytes(7))


@case("nmt stop 5", out="stopped.*heartbeat")
@case("nmt state 5", out="stopped")
class HeartbeatOfTwoBytes(LongHeartbeat):
    """Heartbeats have two bytes."""

    def heartbeat(self):
        self.send(0x700 + self.node, bytes([self.state, 0xAA]))


@case("scan --passive", 3, never="(?m)^ *5 ")
class EmptyFrames(LongHeartbeat):
    """Frames of 0 bytes in place of heartbeats do not count as heartbeats."""

    def heartbeat(self):
        self.send(0x700 + self.node)


@case("log 5 --duration 2s --events {dir}/events.csv", out=",ch1,1.25,", err="5030h.*times more")
class EmergencyStorm(Device):
    """The same emergency every 2 ms; TPDO1 every 100 ms."""

    tick_interval = 0.002
    ticks = 0

    def change(self):
        self.objects[0x1800, 2], self.objects[0x1800, 5] = b"\xfe", uint(100, 2)

    def sync(self, _data):
        pass

    def tick(self):
        self.ticks += 1
        self.send(0x80 + self.node, b"\x30\x50\x81\1\1\0\0\0")
        if self.ticks % 50 == 0:
            self.send_pdo()


# The TPDO of the signal.

@case(SYNC, rows=None, out=",1.25,bar,ok", err="8 bytes.*5")
class LongPdo(Device):
    """TPDO1 always has eight bytes; five are mapped."""

    def pdo(self):
        return super().pdo().ljust(8, b"\0")


@case(SYNC, 3, rows=None, err="8.*5|5.*8", never=",1.25,bar,ok")
class PdoOfMixedLengths(Device):
    """TPDO1 has eight and six bytes in turn; five are mapped."""

    count = 0

    def pdo(self):
        self.count += 1
        return super().pdo().ljust(8 if self.count % 2 else 6, b"\0")


@case(SYNC, 3, err=("3 bytes", "5", "--poll"), never=",1.25,")
class ShortPdo(Device):
    """TPDO1 has three bytes; five are mapped."""

    def pdo(self):
        return super().pdo()[:3]


@case(SYNC, 3, err="(?i)off|not valid|disabled", never="event timer")
class PdoOff(Device):
    """TPDO1 is off: bit 31 of 1800h:1."""

    def change(self):
        self.objects[0x1800, 1] = uint(0x80000180 + self.node, 4)

    def sync(self, _data):
        pass


@case(SYNC, 3, err="RTR|request", never="event timer")
class OnRequest(Device):
    """Transmission type 253: TPDO1 is sent after an RTR."""

    def change(self):
        self.objects[0x1800, 2] = b"\xfd"

    def sync(self, _data):
        pass


@case("log 5 --duration 2s", 3, err="event timer|60", never="steady")
class SlowTimer(Device):
    """The event timer is 60 s."""

    def change(self):
        self.objects[0x1800, 2], self.objects[0x1800, 5] = b"\xfe", uint(60000, 2)

    def sync(self, _data):
        pass


@case("log 5 --duration 2s", 3, err="SYNC", never="event timer")
class WaitsForSync(Device):
    """TPDO1 follows a SYNC, and no node sends one."""


@case(SYNC, 3, err="MPDO|multiplex", never="event timer")
class Multiplexed(Device):
    """1A00h:0 is FEh: a multiplexed PDO."""

    def change(self):
        self.objects[0x1A00, 0] = b"\xfe"

    def sync(self, _data):
        pass


@case(SYNC, out=",-1.23,bar,")
class LengthWithHighestBit(Device):
    """The mapping entry is 0x71300190: 16 bits and the highest bit of the length."""

    def change(self):
        self.array(0x7130, sint(-123, 2))
        self.map(0x71300190)


@case(SYNC, out=",1.25,bar,")
class FloatWithHighestBit(Device):
    """The mapping entry is 0x613001A0."""

    def change(self):
        self.map(0x613001A0)


@case(SYNC, out=",1.25,bar,ok")
class FilledWithZeros(Device):
    """1A00h:0 is 8: two entries, and six of 0."""

    def change(self):
        self.map(0x61300120, 0x61500108, 0, 0, 0, 0, 0, 0)
        self.objects[0, 0] = b""
