"""`cangauge conform` judges devices of python-canopen and durand on real SocketCAN.

    conform.py BINARY IFACE [NAME...]

Each device is compared with the EDS file that its own library generates. The reported deviations must be those listed
below. Each of them has a sentence and a sequence of raw frames that shows it without cangauge.

    tests/socketcan/vcan -t 600 target/peers/bin/python tests/peers/conform.py target/debug/cangauge vcan0
"""

import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import time

from harness import GIVE_UP, HERE, run_checks

NODE = 5
# The mapping entries of TPDO 1: 6130h:1 with 32 bits.
PRESSURE = "20013061"
# Each sequence leaves the TPDO switched on, with its own mapping and parameters.
OFF, ON = ("23001801850100C0", "60"), ("2300180185010040", "60")
CLEAR = [OFF, ("2F001A0000000000", "60")]
MAP = [("23001A01" + PRESSURE, "60"), ("23001A0208015061", "60"), ("2F001A0002000000", "60"), ON]

# (request, beginning of the answer): SDO; "" for no answer. (frame, None): any other frame, as in cansend.
# ("count", frame, times, COB-ID, (least, most)): sends a frame several times and counts the frames with the COB-ID.
# ("last", frame, COB-ID, beginning): sends a frame and waits for the answer. ("heartbeat", state): waits for the state.
# ("file", section, line): the EDS file has this line in this section.
COMMON = {
    "SDO-05": (
        "Sub-index 1 of the variable 1000h is answered with the value of sub-index 0.",
        [("4000100100000000", "43001001")],
    ),
    "SDO-23": (
        "A request of six bytes changes 1017h to 64 ms.",
        [("2B1710004000", "60171000"), ("4017100000000000", "4B1710004000"), ("2B17100000000000", "60171000")],
    ),
    "OD-10": (
        "601h, a COB-ID of SDO, is accepted for SYNC.",
        [("2305100001060000", "60051000"), ("4005100000000000", "4305100001060000"), ("2305100080000000", "60")],
    ),
    "PDO-06": (
        "The reserved transmission type 241 is accepted.",
        [("2F001802F1000000", "60001802"), ("4000180200000000", "4F001802F1"), ("2F001802FF000000", "60")],
    ),
    "PDO-20": (
        "The number of mapping entries is set to 0 while bit 31 of the COB-ID is 0.",
        [("4000180100000000", "4300180185010040"), ("2F001A0000000000", "60001A00"), ("2F001A0002000000", "60")],
    ),
    "PDO-21": (
        "An entry is written while the number of entries is 2.",
        [OFF, ("40001A0000000000", "4F001A0002"), ("23001A01" + PRESSURE, "60001A01"), ON],
    ),
    "PDO-22": (
        "1004h, which does not exist, is mapped.",
        [*CLEAR, ("4004100000000000", "80041000"), ("23001A0120000410", "60"), ("2F001A0001000000", "60001A00"), *CLEAR, *MAP],
    ),
    "PDO-23": (
        "1018h:0 is mapped.",
        [*CLEAR, ("23001A0108001810", "60"), ("2F001A0001000000", "60001A00"), *CLEAR, *MAP],
    ),
    "PDO-24": (
        "6130h:1, which has 32 bits, is mapped with 48 bits.",
        [*CLEAR, ("23001A0130013061", "60"), ("2F001A0001000000", "60001A00"), *CLEAR, *MAP],
    ),
    "PDO-25": (
        "Three values of 32 bits are mapped.",
        [*CLEAR, *[(f"23001A0{sub}{PRESSURE}", "60") for sub in (1, 2, 3)], ("2F001A0003000000", "60001A00"), *CLEAR, *MAP],
    ),
    "PDO-26": (
        "65 is accepted as the number of entries.",
        [*CLEAR, ("2F001A0041000000", "60001A00"), *CLEAR, *MAP],
    ),
    "PDO-30": (
        "The inhibit time is written while bit 31 of the COB-ID is 0.",
        [("4000180100000000", "4300180185010040"), ("2B00180340000000", "60001803"), ("2B00180300000000", "60")],
    ),
    "PDO-31": (
        "The CAN-ID is changed to 1F0h while bit 31 of the COB-ID is 0.",
        [("4000180100000000", "4300180185010040"), ("23001801F0010040", "60001801"), OFF, ON],
    ),
    "PDO-32": (
        "601h, a COB-ID of SDO, is accepted for a TPDO.",
        [OFF, ("2300180101060040", "60001801"), OFF, ON],
    ),
}

# The TPDO is sent at each SYNC, in OPERATIONAL.
EACH_SYNC = [("2F00180201000000", "60"), ("000#0105", None)]
STOP_SYNC = [("000#8005", None), ("2F001802FF000000", "60")]

PYTHON_CANOPEN = {
    **COMMON,
    "404-20": (
        "device.py keeps the scale of 9130h:1 (-10000) if the digits in 6132h:1 are changed.",
        [
            ("4032610100000000", "4F32610102"), ("4030910100000000", "43309101F0D8FFFF"), ("2F32610101000000", "60326101"),
            ("4030910100000000", "43309101F0D8FFFF"), ("2F32610102000000", "60"),
        ],
    ),
    "SDO-17": (
        "After the last segment of an upload, a further segment request is answered with an empty segment.",
        [
            ("4008100000000000", "4108100023"),
            *[("6000000000000000", "0"), ("7000000000000000", "1")] * 2, ("6000000000000000", "0"),
            ("7000000000000000", "1F"),
        ],
    ),
    "SDO-18": (
        "After an abort, the aborted upload goes on.",
        [("4008100000000000", "41081000"), ("8008100000000008", ""), ("6000000000000000", "00")],
    ),
    "NMT-08": (
        "SDO requests are answered in STOPPED.",
        [("000#0205", None), ("4000100000000000", "43001000"), ("000#8005", None)],
    ),
    "NMT-12": (
        "An NMT command of three bytes is executed: the heartbeat shows STOPPED.",
        [
            ("2B17100032000000", "60"), ("000#8005", None), ("000#020500", None),
            ("heartbeat", "04"), ("2B17100000000000", "60"), ("000#8005", None),
        ],
    ),
    "PDO-09": (
        "The timer of device.py ignores the inhibit time (250 ms, event timer 100 ms).",
        [
            OFF, ("2B001803C4090000", "60"), ON, ("2F001802FE000000", "60"), ("2B00180564000000", "60"), ("000#0105", None),
            ("count", None, 1, 0x185, (5, 20)), ("000#8005", None), OFF, ("2B00180300000000", "60"), ON,
        ],
    ),
    "PDO-17": (
        "device.py receives SYNC with 80h only: it ignores 1005h.",
        [
            ("23051000F0000000", "60"), *EACH_SYNC, ("count", "0F0#", 3, 0x185, (0, 0)),
            ("count", "080#", 3, 0x185, (3, 3)), *STOP_SYNC, ("2305100080000000", "60"),
        ],
    ),
    "EDS-01": ('The file has the default "0x-2710" for 9130h:1, an INTEGER32.', [("file", "[9130sub1]", "DefaultValue=0x-2710")]),
}

DURAND = {
    **COMMON,
    "SDO-36": (
        "An acknowledgement of 128 segments, after one was sent, is answered with the end of the block upload.",
        [
            ("A000100014000000", "C"), ("A300000000000000", "81"), ("A280140000000000", "CD"), ("8000100000000008", ""),
        ],
    ),
    "NMT-13": (
        "1017h keeps its value over a reset of the communication.",
        [("2B17100031D40000", "60"), ("000#8205", None), ("4017100000000000", "4B17100031D4"), ("2B17100000000000", "60")],
    ),
    "PDO-04": (
        "With transmission type 3, a TPDO follows each SYNC from the third one on: seven of nine.",
        [("2F00180203000000", "60"), ("000#0105", None), ("count", "080#", 9, 0x185, (7, 7)), *STOP_SYNC],
    ),
    "PDO-17": (
        "A TPDO follows SYNC with 80h, not with the COB-ID in 1005h.",
        [
            ("23051000F0000000", "60"), *EACH_SYNC, ("count", "0F0#", 3, 0x185, (0, 0)),
            ("count", "080#", 3, 0x185, (3, 3)), *STOP_SYNC, ("2305100080000000", "60"),
        ],
    ),
    "LSS-07": (
        "Identify remote slave is answered with 47h, the request of the product; CiA 305 requires 4Fh.",
        [
            ("count", "7E5#4634120000000000", 1, 0x7E4, (0, 0)), ("count", "7E5#4704000000000000", 1, 0x7E4, (0, 0)),
            ("count", "7E5#4800000000000000", 1, 0x7E4, (0, 0)), ("count", "7E5#49FFFFFFFF000000", 1, 0x7E4, (0, 0)),
            ("count", "7E5#4A00000000000000", 1, 0x7E4, (0, 0)), ("last", "7E5#4BFFFFFFFF000000", 0x7E4, "47"),
        ],
    ),
    "EDS-01": ('The file has the default "0.0" for 1015h, an UNSIGNED16.', [("file", "[1015]", "DefaultValue=0.0")]),
    "EDS-20": (
        "1000h is mapped, which the file does not call mappable.",
        [*CLEAR, ("23001A0120000010", "60"), ("2F001A0001000000", "60001A00"), *CLEAR, *MAP],
    ),
}


class Frames:
    """Raw frames on the interface."""

    def __init__(self, interface, eds):
        self.eds = eds
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.bind((interface,))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, identifier, data):
        self.socket.send(struct.pack("=IB3x8s", identifier, len(data), data))

    def receive(self, identifier, until):
        """The data of the next frame with this identifier; None after `until`."""
        while (left := until - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                found, length, data = struct.unpack("=IB3x8s", self.socket.recv(16))
            except TimeoutError:
                return None
            if found == identifier:
                return data[:length]
        return None

    def frame(self, text):
        identifier, data = text.split("#")
        self.send(int(identifier, 16), bytes.fromhex(data))

    def shows(self, step):
        """Carries out a step, and checks what follows it."""
        if step[0] == "file":
            with open(self.eds, encoding="utf-8") as file:
                section = file.read().split(step[1], 1)[1].split("[", 1)[0]
            assert step[2] in section.splitlines(), section
        elif step[0] == "count":
            _, text, times, identifier, (least, most) = step
            count = 0
            for _ in range(times):
                if text:
                    self.frame(text)
                # Without a frame, the frames of one second are counted.
                until = time.monotonic() + (0.1 if text else 1)
                while self.receive(identifier, until) is not None:
                    count += 1
            assert least <= count <= most, f"{count} frames with {identifier:03X}h"
        elif step[0] == "last":
            _, text, identifier, wanted = step
            self.frame(text)
            answer = self.receive(identifier, time.monotonic() + GIVE_UP)
            assert answer and answer.hex().upper().startswith(wanted), answer
        elif step[0] == "heartbeat":
            until = time.monotonic() + GIVE_UP
            while (found := self.receive(0x700 + NODE, until)) is not None and found.hex() != step[1]:
                pass
            assert found is not None, "no such heartbeat"
        elif step[1] is None:
            self.frame(step[0])
            # The device may need a moment, and sends no answer.
            self.receive(0, time.monotonic() + 0.2)
        else:
            request, wanted = step
            self.send(0x600 + NODE, bytes.fromhex(request))
            if wanted == "":
                answer = self.receive(0x580 + NODE, time.monotonic() + 0.2)
                assert answer is None, answer
                return
            answer = self.receive(0x580 + NODE, time.monotonic() + GIVE_UP)
            assert answer and answer.hex().upper().startswith(wanted), f"{request}: {answer and answer.hex()}, not {wanted}"


@contextlib.contextmanager
def device(interface, directory, program, *arguments):
    """A device in its own process. Yields its EDS file."""
    eds = os.path.join(directory, "device.eds")
    command = [sys.executable, os.path.join(HERE, program), "--eds", eds, *arguments[:-1], interface, arguments[-1]]
    with open(os.path.join(directory, "device.log"), "w", encoding="utf-8") as log:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, stdin=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout.readline() == "ready\n", f"{program} did not start"
        yield eds
    finally:
        process.terminate()
        process.wait(GIVE_UP)


def judged(cangauge, directory, expected, program, *arguments):
    """Checks a device, then shows each deviation with raw frames."""
    report = os.path.join(directory, "report.json")
    with device(cangauge.interface, directory, program, *arguments) as eds:
        done = cangauge.run("conform", NODE, "--eds", eds, "--store", "--report", report, "--timeout", "2s", exit=1)
        with open(report, encoding="utf-8") as file:
            result = json.load(file)
        cases = {case["case"]: case for case in result["cases"]}
        found = {name for name, case in cases.items() if case["verdict"] == "deviates"}
        details = "\n".join(f"{name}: {cases[name]['details']}" for name in sorted(found ^ set(expected)))
        differing = f"not expected: {found - set(expected)}, not reported: {set(expected) - found}\n{details}"
        assert found == set(expected), differing
        # Nothing changes the input of these devices, and a virtual interface has no bit rate.
        reasons = ["not run without --stimulus", "not run, because the bit rate of the bus is unknown"]
        not_judged = [
            name
            for name, case in cases.items()
            if case["verdict"] == "not-judged" and case["details"] not in ([reason] for reason in reasons)
        ]
        assert not_judged == [], not_judged
        assert result["not_restored"] == [], result["not_restored"]
        assert "arrive twice" not in done.err, done.err
    # Another process: the sequences below do not depend on the cases.
    with device(cangauge.interface, directory, program, *arguments) as eds, Frames(cangauge.interface, eds) as frames:
        for name, (sentence, steps) in expected.items():
            try:
                for step in steps:
                    frames.shows(step)
            except AssertionError as error:
                raise AssertionError(f"{name}: {sentence} {step}: {error}") from error
            print(f"    {name}  {sentence}", flush=True)


def python_canopen(cangauge, directory):
    judged(cangauge, directory, PYTHON_CANOPEN, "device.py", "--quiet", f"{NODE}:real32")


def durand(cangauge, directory):
    judged(cangauge, directory, DURAND, "durand_sensor.py", str(NODE))


if __name__ == "__main__":
    sys.exit(run_checks(sys.argv[1], sys.argv[2], [(python_canopen, ()), (durand, ())], sys.argv[3:]))
