"""Devices whose values are easily misread: unknown types, integers that clip, wrong lengths, overloads."""

from device import Device, real, sint, uint
from table import case

TWO = "log 5 --sync 100ms --count 2"
PSI = uint(0x00AB0000, 4)


# A type that no source states is unknown.

@case(TWO, rows=2, out=",0x2001:0,,,,0xE7FF", err="type of 0x2001:0 is unknown")
@case("read 5 0x2001", 2, err=("received E7 FF", "0x2001:0/i16"), never="65511|-25")
@case("read 5 0x2001:0/i16", out="^-25$")
@case("check 5 '0x2001:0 > 1000'", 2, err="type of 0x2001:0 is unknown", never="ok ")
@case("check 5 '0x2001:0/i16 > 1000'", 1, out="FAIL")
@case("log 5 0x2001 --poll 100ms --count 1 --expect '0x2001:0 > 1000'", 2, never="65511")
class NegativeWithoutProfile(Device):
    """No profile: an INTEGER16 of -25."""

    def change(self):
        self.profile(0)
        self.objects[0x2001, 0] = sint(-25, 2)
        self.map(0x20010010)


@case(TWO, rows=2, out=",0x2300:3,,,,0x00004841", never="1095237632")
@case("check 5 '0x2300:3 < 30'", 2, never="FAIL|ok ")
@case("log 5 0x2300:3/r32 --sync 100ms --count 2", rows=2, out=",12.5,,,0x00004841")
class FloatOfTheMaker(Device):
    """CiA 404, and a REAL32 in an object of the manufacturer."""

    def change(self):
        self.array(0x2300, b"\1", b"\2", real(12.5))
        self.map(0x23000320)


@case(TWO, rows=2, out=(",-12.34,deg,", ",-0.77,deg,"), never="64302|65459")
@case("check 5 '0x6020:0 > 0'", 1, out="FAIL")
class Inclinometer(Device):
    """CiA 410: two slopes below zero."""

    def change(self):
        self.profile(0x0001019A)
        self.objects.update({(0x6000, 0): uint(10, 2), (0x6010, 0): sint(-1234, 2), (0x6020, 0): sint(-77, 2)})
        self.map(0x60100010, 0x60200010)


@case("nmt start 5")
@case("log 5 --sync 100ms --count 2 --no-nmt", rows=2, out=(",-300,", ",165,"))
@case("check 5 '0x6401:1 < 0'", out="ok ")
class AnalogueInputs(Device):
    """CiA 401: an analogue input below zero and eight digital inputs."""

    def change(self):
        self.profile(0x00050191)
        self.array(0x6401, sint(-300, 2))
        self.array(0x6000, b"\xa5")
        self.map(0x64010110, 0x60000108)


@case(TWO, rows=2, out=",-98.1,bar,")
class NetValue(Device):
    """CiA 404 with a tare: the net value 6140h:1, a REAL32."""

    def change(self):
        self.array(0x6140, real(-98.1))
        self.map(0x61400120)


@case(TWO, rows=2, out=",-20.00,bar,", never="16775216")
class NetValueInThreeBytes(Device):
    """CiA 404: the net value 8140h:1, an INTEGER24 with the digits of the channel."""

    def change(self):
        self.array(0x8140, sint(-2000, 3))
        self.map(0x81400118)


# A number that the device did not send.

@case("read 5", out="invalid", err="probably an integer", never="e-4|ok")
@case("check 5 'ch1 < 1'", 1, out="FAIL", never="ok ")
class IntegerAsFloat(Device):
    """6130h:1 is an integer, 12345 with three digits."""

    def change(self):
        self.array(0x6130, sint(12345, 4))
        self.array(0x6132, b"\3")


@case("read 5", out="invalid", never="NaN|nan|ok")
@case("check 5 'ch1 > -1000'", 1, never="ok ")
@case(TWO, rows=2, out=",ch1,,bar,invalid,0xFBFFFFFF")
class NegativeIntegerAsFloat(Device):
    """6130h:1 is an integer, -5: not a number as REAL32."""

    def change(self):
        self.array(0x6130, sint(-5, 4))


@case("read 5", never=r"0\.000|ok", err="6132h is 255")
@case(TWO, rows=2, out=",ch1,,bar,")
class Digits255(Device):
    """9130h:1 is 12345, and 6132h:1 is 255."""

    def change(self):
        self.remove(0x6130, 0x6130)
        self.array(0x9130, sint(12345, 4))
        self.array(0x6132, b"\xff")
        self.map(0x91300120)


@case(TWO, rows=2, out=",ch1,,bar,", never="0E|e-")
@case("check 5 'ch1 < 1' --for 500ms --sync 100ms", 1, never="ok ")
class Digits200(Device):
    """7130h:1 in TPDO1, and 6132h:1 is 200."""

    def change(self):
        self.array(0x7130, sint(777, 2))
        self.array(0x6132, b"\xc8")
        self.map(0x71300110)


@case("check 5 'ch1 < 30000'", 1, never="ok ")
@case("log 5 --poll 100ms --count 2", rows=2, never=",ok,")
@case(TWO, rows=2, never=",ok,")
class DigitsMissing(Device):
    """8130h:1 in TPDO1, and no 6132h."""

    def change(self):
        self.remove(0x6130, 0x6132)
        self.array(0x8130, sint(12345, 3))
        self.map(0x81300118, 0x61500108)


@case(TWO, never=r"ch1,[0-9.-]+")
@case("log 5 --layout wide --sync 100ms --count 2", never=r",[0-9.-]+,ok")
class IntegerAsFloatInTpdo(Device):
    """TPDO1 carries an integer as 6130h:1."""

    def change(self):
        self.array(0x6130, sint(70000, 4))


@case(TWO, never=r"0x6110:1,[0-9-]+,|ch1,[0-9-]+,")
@case("log 5 0x6110:1 --sync 100ms --duration 1s", out="0x0102030405", never=r"0x6110:1,[0-9-]+,")
class MappingLongerThanItsObject(Device):
    """TPDO1 maps 35 bits of 6110h:1, an UNSIGNED16."""

    def change(self):
        self.map(0x61100123, 0x61500108)

    def pdo(self):
        return bytes(range(1, 7))


@case("log 5 0x6110:1 --sync 100ms --duration 1s", out="0x010203", never=r"0x6110:1,[0-9-]+,")
@case("check 5 '0x6110:1 < 100000' --for 500ms --sync 100ms", 2, never="ok ")
class MappingOfThreeBytesOfTwo(MappingLongerThanItsObject):
    """TPDO1 maps 24 bits of 6110h:1."""

    def change(self):
        self.map(0x61100118)

    def pdo(self):
        return bytes(range(1, 4))


# An integer that is the limit of its type is not a value.

class Narrow(Device):
    """An MH-4-CAN in psi whose TPDO1 has an integer that clips."""

    def change(self):
        self.objects[0x1000, 0] = uint(0x00820194, 4)
        self.objects[0x1008, 0] = b"MH-4-CAN"
        self.objects[0x1018, 1], self.objects[0x1018, 2] = uint(0x47, 4), uint(1, 4)
        self.array(0x6130, real(72.5))
        self.array(0x6131, PSI)
        self.array(0x6132, b"\3")


@case(TWO, rows=2, out=",pressure,,psi,clipped,0xFF7F", err="0x6130:1 or 0x9130:1")
@case("check 5 'pressure < 40' --for 500ms --sync 100ms", 1, never="ok ")
@case("log 5 pressure --poll 100ms --count 1", out=",72.5,psi,")
class ClippedHigh(Narrow):
    """7130h:1 is at its upper end."""

    def change(self):
        super().change()
        self.array(0x7130, sint(32767, 2))
        self.map(0x71300110, 0x61500108)


@case(TWO, rows=2, out=",pressure,,psi,clipped,0xFFFF7F")
@case("check 5 'pressure < 9000' --for 500ms --sync 100ms", 1, never="ok ")
class ClippedInThreeBytes(Narrow):
    """8130h:1, an INTEGER24, is at its upper end."""

    def change(self):
        super().change()
        self.array(0x8130, sint(8388607, 3))
        self.map(0x81300118)


@case("nmt start 5")
@case("log 5 --sync 100ms --count 2 --no-nmt", rows=2, out=",32767,", never="clipped")
class FullScaleOfAnInput(Device):
    """CiA 401: 7FFFh of 6401h is a legal full scale."""

    def change(self):
        self.profile(0x00040191)
        self.array(0x6401, sint(32767, 2))
        self.map(0x64010110)


# If the length of a transfer is wrong, no value is printed.

@case("sdo read 5 0x1008", 6, err="585#", never="MH-N")
@case("sdo read 5 0x1008 --output {dir}/name", 6)
class CutTo4(Device):
    """Segmented answers end after four bytes; the name is MH-4-CAN."""

    def change(self):
        self.objects[0x1008, 0] = b"MH-4-CAN"

    def answer(self, data):
        super().answer(data[:4] if data[0] >> 5 == 0 or data[0] == 0x41 else data)


@case("sdo read 5 0x1008", 6, err="585#")
class LastSegmentCut(Device):
    """The last segment declares five bytes and has three."""

    def change(self):
        self.objects[0x1008, 0] = b"Transmitter"

    def answer(self, data):
        super().answer(data[:4] if data[0] >> 5 == 0 and data[0] & 1 else data)


@case("sdo read 5 0x1008", out="^Transmitter$")
class WithoutPadding(Device):
    """Answers are as long as their contents."""

    def change(self):
        self.objects[0x1008, 0] = b"Transmitter"

    def answer(self, data):
        if data[0] >> 5 == 0:
            data = data[:8 - (data[0] >> 1 & 7)]
        super().answer(data)


@case("sdo read 5 0x1008 --output {dir}/name", 6, err="100")
class AnnouncesMore(Device):
    """A name of 9 bytes is announced with 100, and its length changes with every read."""

    reads = 0

    def upload(self, key, value):
        if len(value) <= 4:
            super().upload(key, value)
        else:
            self.reads += 1
            self.reading = key, value + bytes([48 + self.reads]), 0
            self.answer(b"\x41" + uint(key[0], 2) + uint(key[1], 1) + uint(100, 4))

    def change(self):
        self.objects[0x1008, 0] = b"Transmit"


# An overload of a device without status object.

class Dps(Device):
    """A Honeywell DPS, 0 to 100 psi; TPDO1 every 100 ms by its event timer."""

    value, register, emergency = 50000, 0, None
    tick_interval = 0.1

    def change(self):
        self.remove(0x6150, 0x6150)
        self.objects[0x1008, 0] = b"DPS"
        self.objects[0x1018, 1], self.objects[0x1018, 2] = uint(0x362, 4), uint(0x443150, 4)
        self.objects[0x1001, 0] = uint(self.register, 1)
        self.array(0x1003, uint(0x3201, 4))
        self.array(0x6130, sint(self.value, 4))
        self.array(0x6131, PSI)
        self.array(0x6132, b"\3")
        self.array(0x6148, sint(0, 4))
        self.array(0x6149, sint(100000, 4))
        self.objects[0x1800, 2], self.objects[0x1800, 5] = b"\xfe", uint(100, 2)
        self.map(0x61300120)

    def sync(self, _data):
        pass

    def tick(self):
        self.send_pdo()


@case("errors {node}", out="(?i)overflow or underflow|overload|underload")
@case("check {node} 'pressure < 1000'", 1, never="ok ")
@case("read {node}", out="overload-low")
class DpsUnderload(Dps):
    """Error 3201h is pending: register 05h, -5 psi."""

    value, register = -5000, 5


@case("check {node} 'pressure < 1000'", 1, never="ok ")
@case("log {node} --count 2", rows=2, out=",105.000,psi,overload-high,")
class DpsOverload(Dps):
    """105 psi, and the register is 0."""

    value = 105000


@case("log {node} --count 15 --events {dir}/events.csv", out=",50.000,psi,overload-", err="3201h")
class DpsEmergency(Dps):
    """The emergency 3201h while the value, 50 psi, looks good."""

    ticks = 0

    def tick(self):
        super().tick()
        self.ticks += self.state == 5
        if self.ticks == 5:
            self.send(0x80 + self.node, bytes([0x01, 0x32, 5, 0, 0, 0, 0, 0]))
