"""SDO servers and LSS slaves that differ from the standard."""

import time

from device import OPERATIONAL, PRE_OPERATIONAL, STOPPED, Device, sint, uint
from table import case


# A command continues if an optional object does not answer.

class Without(Device):
    """Does not answer reads of some objects."""

    silent = (0x1008,)

    def request(self, data):
        if data[0] >> 5 != 2 or data[1] | data[2] << 8 not in self.silent:
            super().request(data)


@case("scan 5", out="0x00004321")
@case("read 5", out="1.25 bar")
@case("log 5 --sync 100ms --count 2", rows=2)
@case("check 5 'ch1 < 5'", out="ok ")
@case("info 5", out="1.25")
class NoName(Without):
    """Does not answer 1008h."""


@case("scan 5", out="CASE")
@case("read 5", out="1.25 bar")
class NoIdentity(Without):
    """Does not answer 1018h."""

    silent = (0x1018,)


@case("scan 5", out="0x00004321")
@case("read 5", out="1.25 bar")
class WrongToggle(Device):
    """The segments of the name have a wrong toggle bit."""

    def change(self):
        self.objects[0x1008, 0] = b"A transmitter"

    def answer(self, data):
        super().answer(bytes([data[0] ^ 0x10]) + data[1:] if data[0] >> 5 == 0 else data)


@case("scan 5", out="0x00004321")
@case("read 5", out="1.25 bar")
class LateName(Device):
    """The answer for 1008h comes after 0.8 s."""

    def upload(self, key, value):
        if key == (0x1008, 0):
            time.sleep(0.8)
        super().upload(key, value)


# The received bytes are reported.

@case("sdo write 5 0x1017 500 --type u16")
@case("sdo read 5 0x1017 --type u16", out="^500$")
class IndexZero(Device):
    """Acknowledges a write with index 0 and sub-index 0."""

    def answer(self, data):
        super().answer(b"\x60" + bytes(7) if data[0] == 0x60 else data)


@case("sdo write 5 0x1017 500 --type u16", 3, err="585#60")
class IndexZeroWithoutEffect(IndexZero):
    """Acknowledges a write with index 0, and does not execute it."""

    def write(self, key, value):
        return 0


@case("sdo read 5 0x1017", 3, err="585#4B17100[1F]")
class OtherSubIndex(Device):
    """Answers with sub-index 1 instead of 0."""

    def upload(self, key, value):
        super().upload((key[0], key[1] or 1) if key[0] == 0x1017 else key, value)


@case("read {node}", out="50.000 psi|", err="|upload-answered60")
class Answers60(Device):
    """A DPS that answers reads with 60h, as in table 19 of its manual."""

    def change(self):
        self.objects[0x1008, 0] = b"DPS"
        self.objects[0x1018, 1], self.objects[0x1018, 2] = uint(0x362, 4), uint(0x443150, 4)
        self.array(0x6130, sint(50000, 4))
        self.array(0x6131, uint(0x00AB0000, 4))
        self.array(0x6132, b"\3")
        self.map(0x61300120)

    def upload(self, key, value):
        self.answer(b"\x60" + uint(key[0], 2) + uint(key[1], 1) + value[:4].ljust(4, b"\0"))


# Slow devices.

class DeafAfterBoot(Device):
    """No SDO answer for 2.5 s after the boot-up of a reset."""

    deaf_until = 0

    def change(self):
        for index in (0x1010, 0x1011):
            self.array(index, uint(1, 4))

    def write(self, key, value):
        return 0 if key[0] in (0x1010, 0x1011) else super().write(key, value)

    def reset(self):
        super().reset()
        self.deaf_until = time.monotonic() + 2.5

    def request(self, data):
        if time.monotonic() >= self.deaf_until:
            super().request(data)


case("store 5 --verify", out="(?i)reset")(type("DeafAfterStore", (DeafAfterBoot,), {"__doc__": DeafAfterBoot.__doc__}))
case("restore 5 --reset")(type("DeafAfterRestore", (DeafAfterBoot,), {"__doc__": DeafAfterBoot.__doc__}))
case("nmt reset 5", out="pre-operational|boot-up")(
    type("DeafAfterReset", (DeafAfterBoot,), {"__doc__": DeafAfterBoot.__doc__}))


@case("read 5", out="1.25 bar")
@case("read 5 -t 2s", out="1.25 bar")
class SlowThird(Device):
    """Every third answer comes after 0.9 s; the name has more than seven bytes."""

    answers = 0

    def change(self):
        self.objects[0x1008, 0] = b"CASE with a long name"

    def answer(self, data):
        self.answers += 1
        if self.answers % 3 == 0:
            time.sleep(0.9)
        super().answer(data)


@case("sdo read 5 0x1000 0x1018:2 --retries 0", 3, err="-t 2s")
@case("sdo read 5 0x1000 0x1018:2 -t 2s", out="0x1018:2")
class SlowObject(Device):
    """The answer with the product code comes after 0.9 s."""

    def answer(self, data):
        if data[1:4] == bytes((0x18, 0x10, 2)):
            time.sleep(0.9)
        super().answer(data)


def crc(data):
    """The CRC of SDO block transfers."""
    value = 0
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ 0x1021 if value & 0x8000 else value << 1) & 0xFFFF
    return value


class Block(Device):
    """1021h by block upload."""

    text = b"[FileInfo]\nFileName=case.eds\n" * 8 + b"end"
    block = 0, 0                # bytes sent, segments of a block

    def change(self):
        self.objects[0x1021, 0] = self.text

    def checksum(self):
        return crc(self.text)

    def request(self, data):
        if data[0] & 0xE3 == 0xA0 and data[1:4] == b"\x21\x10\0":
            self.block = 0, data[4]
            self.answer(b"\xc6" + data[1:4] + uint(len(self.text), 4))
        elif data[0] == 0xA3:
            self.send_block()
        elif data[0] == 0xA2:
            self.block = self.block[0] + 7 * data[1], data[2]
            if self.block[0] < len(self.text):
                self.send_block()
            else:
                self.answer(bytes([0xC1 | -len(self.text) % 7 << 2]) + uint(self.checksum(), 2) + bytes(5))
        elif data[0] != 0xA1:
            super().request(data)

    def send_block(self):
        start, count = self.block
        for number in range(1, count + 1):
            part, start = self.text[start:start + 7], start + 7
            is_last = start >= len(self.text)
            self.answer(bytes([number | is_last << 7]) + part.ljust(7, b"\0"))
            if is_last:
                return


@case("sdo read 5 0x1021 --type d --output {dir}/f --force --block always", 6, err="--block never")
@case("sdo read 5 0x1021 --type d --output {dir}/f --force")
@case("sdo read 5 0x1021 --type d --output {dir}/f --force --block never")
class CrcOfThePadding(Block):
    """The CRC includes the padding of the last segment."""

    def checksum(self):
        return crc(self.text + bytes(-len(self.text) % 7))


@case("sdo read 5 0x1021 --type d --output {dir}/f --force")
class CrcOfTheData(Block):
    """A block transfer without faults."""


# LSS.

class Lss(Device):
    """A configured LSS slave."""

    pause = 0                   # seconds that it needs between two frames
    states = (PRE_OPERATIONAL, OPERATIONAL, STOPPED)
    configuring, matched, last = 0, 0, 0.0

    def change(self):
        self.pending = self.stored = self.node

    def reset(self):
        self.node = self.stored
        self.objects[0x1800, 1] = uint(0x180 + self.node, 4)
        super().reset()

    def frame(self, identifier, data):
        if identifier == 0x7E5:
            before, self.last = self.last, self.received_at
            if self.last - before >= self.pause and self.state in self.states:
                self.lss(data.ljust(8, b"\0"))
        else:
            super().frame(identifier, data)

    def lss(self, data):
        service, answer = data[0], None
        if service == 0x04:
            self.configuring = data[1]
        elif 0x40 <= service <= 0x43:
            part = service - 0x40
            fits = data[1:5] == self.objects[0x1018, part + 1] and self.matched == part
            self.matched = self.matched + 1 if fits else 0
            if self.matched == 4:
                self.configuring, self.matched, answer = 1, 0, b"\x44"
        elif not self.configuring:
            return
        elif 0x5A <= service <= 0x5D:
            answer = bytes([service]) + self.objects[0x1018, service - 0x59]
        elif service == 0x5E:
            answer = bytes([service, self.node])
        elif service in (0x11, 0x13, 0x17):
            if service == 0x11:
                self.pending = data[1]
            elif service == 0x17:
                self.stored = self.pending
            answer = bytes([service, 0])
        if answer:
            self.send(0x7E4, answer.ljust(8, b"\0"))


@case("lss set-id 5 9", out="^9$", err="identity confirmed")
class LssPlain(Lss):
    """No faults."""


@case("lss set-id 5 9", out="^9$", err="identity confirmed")
class LssSlow(Lss):
    """Loses a frame that comes less than 20 ms after the previous one."""

    pause = 0.02


@case("lss set-id 5 9", out="^9$", err="identity confirmed")
class LssInStopped(Lss):
    """LSS only in STOPPED."""

    states = (STOPPED,)


@case("lss inquire 5", out="0x4321:0x2:0x10000:1001  node 5", err="tried again in STOPPED")
class LssInStoppedInquire(LssInStopped):
    """LSS only in STOPPED, for one service."""
