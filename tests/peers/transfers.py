"""SDO transfers with servers of python-canopen and durand and a client of python-canopen, on real SocketCAN.

    transfers.py BINARY IFACE [NAME...]

Transfers data of all sizes in both directions, expedited, in segments and in blocks. The devices are made with
python-canopen (no block transfer) and durand (with block transfer). python-canopen is also the master of a simulated
device. After every abort and every Ctrl-C the server must accept the next transfer.

    tests/socketcan/vcan target/peers/bin/python tests/peers/transfers.py target/debug/cangauge vcan0
"""

import ast
import contextlib
import json
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import time

import canopen
from canopen.sdo import SdoAbortedError

from harness import GIVE_UP, HERE, PATIENT, Recording, run_checks, wait_for
from values import VALUES

NODE = 42
# No device has this node-ID.
ABSENT = 77
# Sizes near the limits of an expedited frame, a segment, the threshold of --block auto and a sub-block.
SIZES = [0, 1, 4, 5, 7, 8, 28, 29, 889, 890]
# A transfer of about ten seconds with a Python server, at one or two milliseconds per segment.
LARGE = 100_000
# A transfer of the same duration with the simulator.
HUGE = 1_000_000
# A size that takes too long, for transfers that are aborted.
ENDLESS = 16 << 20
MODES = ["auto", "always", "never"]
# No retries: a request after an error must succeed at once.
ONCE = ["--retries", 0, *PATIENT]

READ_ONLY, NO_OBJECT, NO_SUB_INDEX, LENGTH = "0x06010002", "0x06020000", "0x06090011", "0x06070010"
NO_DATA, NO_SUCH_COMMAND, MEMORY = "0x08000024", "0x05040001", "0x05040005"


def content(size, seed):
    """Bytes that differ from those of any other transfer."""
    return random.Random(f"{size} {seed}").randbytes(size)


class Wire:
    """The SDO frames of one node, in order of arrival."""

    def __init__(self, interface, node=NODE):
        self.request, self.requests, self.count = 0x600 + node, [], 0
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        # SO_RCVBUFFORCE: the limit of the guest is too low for a sub-block on a busy guest.
        self.socket.setsockopt(socket.SOL_SOCKET, 33, 8 << 20)
        filters = struct.pack("=IIII", self.request, 0x7FF, 0x580 + node, 0x7FF)
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, filters)
        self.socket.setblocking(False)
        self.socket.bind((interface,))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def drain(self):
        """Reads the waiting frames and keeps the requests."""
        with contextlib.suppress(BlockingIOError):
            while True:
                identifier, length, data = struct.unpack("=IB3x8s", self.socket.recv(16))
                self.count += 1
                if identifier == self.request:
                    self.requests.append(data[:length])
        return self


class Store:
    """A device made by store.py, and its files."""

    def __init__(self, cangauge, directory, peer, *options):
        self.cangauge, self.directory, self.peer = cangauge, directory, peer
        self.files = os.path.join(directory, peer)
        os.makedirs(self.files, exist_ok=True)
        self.write(0x2000, b"as delivered")
        self.write(0x2001, b"to be read")
        command = [sys.executable, os.path.join(HERE, "store.py"), peer, "--files", self.files, *options]
        self.process = subprocess.Popen([*command, cangauge.interface, str(NODE)], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n", "store.py did not start"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.returncode is None:
            self.process.terminate()
            status = self.process.wait(GIVE_UP)
            assert status == 0, f"store.py: exit status {status}"

    def kill(self):
        """Ends it, as a power failure does."""
        self.process.kill()
        self.process.wait(GIVE_UP)

    def path(self, index):
        return os.path.join(self.files, f"{index:04X}")

    def read(self, index):
        with open(self.path(index), "rb") as file:
            return file.read()

    def write(self, index, data):
        with open(self.path(index), "wb") as file:
            file.write(data)


class Files:
    """Files for --input and --output, each used once."""

    def __init__(self, directory):
        self.directory, self.count = directory, 0

    def new(self, data=None):
        self.count += 1
        path = os.path.join(self.directory, f"file{self.count}")
        if data is not None:
            with open(path, "wb") as file:
                file.write(data)
        return path


def held(path):
    with open(path, "rb") as file:
        return file.read()


def first_request(path, index):
    """The command byte of the last request for an object in a trace. It shows the kind of transfer."""
    wanted = struct.pack("<HB", index, 0).hex().upper()
    frames = [line.split()[-1] for line in open(path, encoding="ascii") if f" {0x600 + NODE:03X}#" in line]
    commands = [frame.split("#")[1] for frame in frames]
    return [int(data[:2], 16) for data in commands if data[2:8] == wanted and data[:2] != "80"]


def table(cangauge, directory, peer, blocks):
    """Each size, in both directions, in each mode."""
    files = Files(directory)
    with Store(cangauge, directory, peer) as store:
        for mode in MODES:
            for size in SIZES:
                sent = content(size, f"{mode} down")
                trace = files.new()
                arguments = ["--trace", trace, "sdo", "write", NODE, "2000", "--block", mode, "--input", files.new(sent)]
                if mode == "always" and not blocks:
                    # Rejected before any data was transferred, so the object is unchanged.
                    before = store.read(0x2000)
                    refused = cangauge.run(*PATIENT, *arguments, exit=4)
                    assert NO_SUCH_COMMAND in refused.err, refused
                    sent = before
                else:
                    written = cangauge.run(*PATIENT, *arguments)
                    assert written.out == written.err == "", written
                assert store.read(0x2000) == sent, f"{mode}: {size} bytes written"
                asked = first_request(trace, 0x2000)
                in_blocks = mode == "always" or mode == "auto" and size > 28
                assert (asked[0] >> 5 == 6) == in_blocks, f"{mode}: {size} bytes written: {asked}"
                assert len(asked) == (2 if mode == "auto" and in_blocks and not blocks else 1), asked
            for size in SIZES:
                # DOMAIN is read in blocks. An object of unknown type is read in blocks only if it is large.
                for of_type in ([], ["--type", "d"]):
                    sent = content(size, f"{mode} up {of_type}")
                    store.write(0x2000, sent)
                    trace, path = files.new(), files.new()
                    arguments = ["--trace", trace, "sdo", "read", NODE, "2000", "--block", mode, "--output", path, *of_type]
                    if size == 0 and peer == "canopen":
                        # It reports "no data" for an empty object.
                        refused = cangauge.run(*PATIENT, *arguments, exit=4)
                        assert NO_DATA in refused.err and not os.path.exists(path), refused
                        continue
                    result = cangauge.run(*PATIENT, *arguments)
                    assert held(path) == sent, f"{mode} {of_type}: {size} bytes read\n{result}"
                    # durand declares a full last segment completely unused.
                    odd = peer == "durand" and size > 0 and size % 7 == 0 and uses_blocks(mode, size, of_type)
                    assert ("unused" in result.err) == odd and (odd or result.err == ""), result
                    asked = first_request(trace, 0x2000)
                    wanted = [5] if mode == "always" or mode == "auto" and of_type else [2]
                    wanted += [5] if mode == "auto" and not of_type and size >= 889 else []
                    assert [command >> 5 for command in asked] == wanted, f"{mode} {of_type}: {size}: {asked}"
        # Large objects, in each direction once in segments and once in blocks, if supported.
        for mode in ("never", "auto") if blocks else ("auto",):
            sent = content(LARGE, mode)
            cangauge.run(*PATIENT, "sdo", "write", NODE, "2000", "--block", mode, "--input", files.new(sent))
            assert store.read(0x2000) == sent, f"{mode}: {LARGE} bytes written"
            path = files.new()
            cangauge.run(*PATIENT, "sdo", "read", NODE, "2000", "--block", mode, "--output", path)
            assert held(path) == sent, f"{mode}: {LARGE} bytes read"


def uses_blocks(mode, size, of_type):
    """Whether durand answers a read in blocks: up to the threshold it may answer in segments."""
    return mode == "always" or mode == "auto" and size > (28 if of_type else 888)


def python_canopen_device(cangauge, directory):
    """Expedited and segmented. It rejects block downloads, and answers block uploads in segments."""
    table(cangauge, directory, "canopen", blocks=False)


def durand_device(cangauge, directory):
    """Expedited, segmented and in blocks."""
    table(cangauge, directory, "durand", blocks=True)


SIMULATED = """
name = "store"
title = "Store"
vendor = "cangauge"
source = "tests/peers/transfers.py"

[identify]
device_type = 0x00000000

[sdo]
block = true

[[object]]
at = "0x1000"
name = "device-type"
type = "u32"
access = "ro"
default = 0

[[object]]
at = "0x2000"
name = "data"
type = "d"
access = "rw"
default = "0x61732064656C697665726564"

[[object]]
at = "0x2001"
name = "data-to-read"
type = "d"
access = "ro"
default = "0x746F2062652072656164"

[[object]]
at = "0x2003"
name = "long"
type = "d"
access = "rw"

[[object]]
at = "0x2002"
name = "number"
type = "u32"
access = "rw"
default = 0
"""


@contextlib.contextmanager
def simulated(cangauge, directory):
    """A simulated device with all kinds of transfer, in a separate process."""
    with open(os.path.join(directory, "store.toml"), "w", encoding="ascii") as file:
        file.write(SIMULATED)
    bench = os.path.join(directory, "bench.toml")
    with open(bench, "w", encoding="ascii") as file:
        file.write(f'[[device]]\nkind = "store.toml"\nnode = {NODE}\n')
    with cangauge.simulator(bench, directory) as simulator:
        yield
        simulator.finish()


class PythonMaster:
    """python-canopen as client of one node."""

    def __init__(self, interface):
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=interface)
        self.sdo = self.network.add_node(NODE, canopen.ObjectDictionary()).sdo
        self.sdo.RESPONSE_TIMEOUT = 20

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.network.disconnect()

    def settle(self):
        """Discards answers to other masters, which this master receives too."""
        self.sdo.send_request(struct.pack("<BHB4x", 0x40, 0x2002, 0))
        while self.sdo.responses.get(timeout=GIVE_UP)[1:4] != b"\x02\x20\x00":
            pass

    def read(self, index, blocks=False):
        with self.sdo.open(index, 0, "rb", buffering=0, block_transfer=blocks) as file:
            return file.read()

    def write(self, index, data, blocks=False):
        with self.sdo.open(index, 0, "wb", buffering=0, size=len(data), block_transfer=blocks) as file:
            if blocks and not data:
                # By default it ends the transfer without a segment.
                file.send(b"", end=True)
            for at in range(0, len(data), 4 if not blocks and len(data) <= 4 else 7):
                file.write(data[at:at + 7])

    def refusal(self, action):
        """The abort code with which an action is rejected."""
        try:
            action()
        except SdoAbortedError as error:
            return error.code
        raise AssertionError("not refused")


def python_master_of_a_simulated_device(cangauge, directory):
    """Each size, in both directions, in segments and in blocks. One program writes, the other reads."""
    files = Files(directory)
    with simulated(cangauge, directory), PythonMaster(cangauge.interface) as master:
        assert master.read(0x2000) == b"as delivered" == master.read(0x2000, blocks=True)
        for size in SIZES:
            for blocks in (False, True):
                sent, path = content(size, f"python {blocks}"), files.new()
                master.write(0x2000, sent, blocks)
                # Read with the other kind of transfer, and with cangauge.
                assert master.read(0x2000, not blocks) == sent, f"{size} bytes, blocks {blocks}"
                cangauge.run(*PATIENT, "sdo", "read", NODE, "2000", "--output", path)
                assert held(path) == sent, f"{size} bytes, blocks {blocks}"
                master.settle()
            sent = content(size, "cangauge")
            cangauge.run(*PATIENT, "sdo", "write", NODE, "2000", "--input", files.new(sent))
            master.settle()
            for blocks in (False, True):
                assert master.read(0x2000, blocks) == sent, f"{size} bytes, blocks {blocks}"
        # A Python client is slow: this size only, once in each direction.
        for blocks in (False, True):
            sent = content(LARGE, f"python {blocks}")
            master.write(0x2000, sent, blocks)
            assert master.read(0x2000, not blocks) == sent, f"{LARGE} bytes, blocks {blocks}"
        # After each rejection the next transfer succeeds at once, in both directions.
        for blocks in (False, True):
            for data in (b"ab", bytes(9), bytes(2000)):
                for index, code in ((0x2001, READ_ONLY), (0x3000, NO_OBJECT), (0x2002, None)):
                    found = master.refusal(lambda: master.write(index, data, blocks))
                    assert found == int(code, 16) if code else found >> 16 == 0x0607, (index, hex(found))
                    assert master.read(0x2001, blocks) == b"to be read"
            assert master.refusal(lambda: master.read(0x3000, blocks)) == int(NO_OBJECT, 16)
            assert master.read(0x2001) == b"to be read"


def huge_transfers_of_a_simulated_device(cangauge, directory):
    """A million bytes in both directions, in each mode for which the guest is fast enough."""
    files = Files(directory)
    with simulated(cangauge, directory):
        for mode, size in (("auto", HUGE), ("always", LARGE), ("never", LARGE)):
            sent, path = content(size, mode), files.new()
            cangauge.run(*PATIENT, "sdo", "write", NODE, "2000", "--block", mode, "--input", files.new(sent))
            cangauge.run(*PATIENT, "sdo", "read", NODE, "2000", "--block", mode, "--output", path)
            assert held(path) == sent, mode
        for mode in MODES:
            for size in SIZES:
                sent, path = content(size, mode), files.new()
                cangauge.run(*PATIENT, "sdo", "write", NODE, "2000", "--block", mode, "--input", files.new(sent), "--verify")
                cangauge.run(*PATIENT, "sdo", "read", NODE, "2000", "--block", mode, "--output", path)
                assert held(path) == sent, (mode, size)


def refusals(cangauge, files, blocks):
    """Each rejection in each mode. After each one the server accepts the next transfer at once."""
    def run(*arguments, words, exit=4):
        result = cangauge.run(*PATIENT, "sdo", *arguments, exit=exit)
        lines = result.err.splitlines()
        assert result.out == "" and lines[0].startswith(f"cangauge: node {NODE}: "), result
        assert all(word in lines[0] for word in words), f"{words}\n{result}"
        sent, path = content(50, str(arguments)), files.new()
        cangauge.run(*ONCE, "sdo", "write", NODE, "2000", "--input", files.new(sent))
        cangauge.run(*ONCE, "sdo", "read", NODE, "2000", "--output", path)
        assert held(path) == sent, f"after {arguments}"

    for mode in MODES:
        how = ["--block", mode]
        for size in (2, 9, 50, 2000):
            data = files.new(content(size, "refused"))
            if mode == "always" and not blocks:
                run("write", NODE, "2000", "--input", data, *how, words=["write 0x2000", NO_SUCH_COMMAND])
                continue
            run("write", NODE, "2001", "--input", data, *how, words=["write 0x2001", READ_ONLY])
            run("write", NODE, "3000", "--input", data, *how, words=["write 0x3000", NO_OBJECT])
            # "Length does not match"; a server may send the specific codes 12h (too long) or 13h (too short).
            run("write", NODE, "2002", "--input", data, *how, words=["write 0x2002", "0x0607001"])
        run("read", NODE, "3000", "--type", "d", *how, words=["read 0x3000", NO_OBJECT])
        run("read", NODE, "3000", *how, words=["read 0x3000", NO_OBJECT])


def after_refusals(cangauge, directory):
    """All three servers."""
    files = Files(directory)
    for peer in ("canopen", "durand"):
        with Store(cangauge, directory, peer):
            refusals(cangauge, files, blocks=peer == "durand")
            refused = cangauge.run(*PATIENT, "sdo", "read", NODE, "1018:9", exit=4)
            assert NO_SUB_INDEX in refused.err, refused
    with simulated(cangauge, directory):
        refusals(cangauge, files, blocks=True)
    for mode in MODES:
        for arguments in (["read", ABSENT, "2000"], ["write", ABSENT, "2000", "--input", files.new(bytes(50))]):
            result = cangauge.run("--timeout", "200ms", "sdo", *arguments, "--block", mode, exit=3)
            assert result.out == "" and result.err.startswith(f"cangauge: node {ABSENT}: "), result
            assert f"{arguments[0]} 0x2000:0: no answer within 200 ms" in result.err, result


def interrupt(cangauge, directory, object, arguments):
    """Ctrl-C during a transfer; the server gets an abort."""
    with Wire(cangauge.interface) as wire:
        run = Recording(cangauge.command(*PATIENT, "sdo", *arguments), directory)
        try:
            wait_for(lambda: wire.drain().count > 500, lambda: f"{wire.count} frames\n{run.text('err')}", run.process)
            run.process.send_signal(signal.SIGINT)
            wait_for(lambda: wire.drain() and not run.is_running(), lambda: "it does not end")
            result = run.finish(exit=130, end=None)
        finally:
            run.kill()
        last = wire.drain().requests[-1]
    assert last[:4] == b"\x80" + struct.pack("<HB", object, 0), f"{arguments}: {last.hex()}"
    assert result.out == "" and result.err == "cangauge: interrupted\n", result


def interrupted(cangauge, directory, files, long, size, ways):
    """Ctrl-C during a read of the object `long` and during a write of this size, for each kind of transfer. After each
    one the server accepts the next transfer at once."""
    for mode in ways:
        before, output = content(100, "before"), files.new()
        cangauge.run(*ONCE, "sdo", "write", NODE, "2000", "--input", files.new(before))
        interrupt(cangauge, directory, long, ["read", NODE, f"{long:04X}", "--block", mode, "--output", output])
        # Partial data is not printed.
        assert not os.path.exists(output)
        holds(cangauge, files, before)
        interrupt(cangauge, directory, 0x2000, ["write", NODE, "2000", "--block", mode, "--input", files.new(bytes(size))])
        # A partial write has no effect.
        holds(cangauge, files, before)
        for after in ("auto", "never"):
            interrupt(cangauge, directory, long, ["read", NODE, f"{long:04X}", "--block", mode, "--output", output])
            sent = content(1000, after)
            cangauge.run(*ONCE, "sdo", "write", NODE, "2000", "--input", files.new(sent), "--block", after)
            holds(cangauge, files, sent, "--block", after)


def holds(cangauge, files, data, *how):
    """Checks the result of a read without retries."""
    path = files.new()
    cangauge.run(*ONCE, "sdo", "read", NODE, "2000", "--output", path, *how)
    assert held(path) == data, how


def after_ctrl_c(cangauge, directory):
    """All three servers."""
    files = Files(directory)
    with Store(cangauge, directory, "canopen"):
        interrupted(cangauge, directory, files, 0x2003, ENDLESS, ["never"])
    with Store(cangauge, directory, "durand"):
        interrupted(cangauge, directory, files, 0x2003, ENDLESS, ["never", "always"])
    with simulated(cangauge, directory):
        # The largest size that it accepts; it still takes several seconds.
        cangauge.run(*PATIENT, "sdo", "write", NODE, "2003", "--input", files.new(content(HUGE, "long")))
        interrupted(cangauge, directory, files, 0x2003, HUGE, ["never", "always"])


def types(cangauge, directory):
    """Each type in both directions: cangauge writes and python-canopen reads, and the reverse."""
    with Store(cangauge, directory, "canopen") as store:
        for name in dict.fromkeys(name for _, name, _, _ in VALUES):
            texts = [(sub, text) for sub, (_, of_type, _, text) in enumerate(VALUES, start=1) if of_type == name]
            read = cangauge.run(*PATIENT, "sdo", "read", NODE, *(f"2101:{sub}" for sub, _ in texts), "--type", name).out
            assert read == "".join(f"0x2101:{sub} {text}\n" for sub, text in texts), read
            pairs = [f"2100:{sub}={text}" for sub, text in texts]
            cangauge.run(*PATIENT, "sdo", "write", NODE, *pairs, "--type", name, "--verify")
        with open(os.path.join(store.files, "values"), encoding="utf-8") as file:
            lines = [line.rstrip("\n").split(" ", 1) for line in file]
    assert len(lines) == len(VALUES), lines
    for sub, ((found_sub, found), (_, name, value, text)) in enumerate(zip(lines, VALUES), start=1):
        found = ast.literal_eval(found)
        assert int(found_sub) == sub and found == value and type(found) is type(value), (name, text, found, value)


def nmt_without_heartbeat(cangauge, directory):
    """An unknown state is null; a probe or a missing SDO answer (stopped) determines it."""
    def nmt(*command, timeout="20s", **options):
        result = cangauge.run("--timeout", timeout, "nmt", *command, "--format", "json", **options)
        return [(line["state"], line["by"]) for line in result.json()]

    def silent(*command, **options):
        """Runs a command that fails after its time-out."""
        return nmt(*command, timeout="3s", **options)

    with Store(cangauge, directory, "canopen"):
        assert silent("state", NODE) == [(None, "none")]
        assert nmt("state", NODE, "--probe") == [("pre-operational", "heartbeat")]
        assert cangauge.run(*PATIENT, "sdo", "read", NODE, "1017").out == "0\n", "the probe did not restore 1017h"
        assert silent("start", NODE) == [(None, "none")]
        assert silent("start", NODE, "--confirm", exit=3) == [(None, "none")]
        assert nmt("state", NODE, "--probe") == [("operational", "heartbeat")]
        assert silent("preop", NODE) == [(None, "none")]
        assert nmt("state", NODE, "--probe") == [("pre-operational", "heartbeat")]
    with Store(cangauge, directory, "canopen", "--heartbeat", "100"):
        assert nmt("state", NODE) == [("pre-operational", "heartbeat")]
        assert nmt("start", NODE, "--confirm") == [("operational", "heartbeat")]
        assert nmt("stop", NODE, "--confirm") == [("stopped", "heartbeat")]
        assert nmt("state", NODE) == [("stopped", "heartbeat")]
        assert nmt("preop", NODE, "--confirm") == [("pre-operational", "heartbeat")]
        cangauge.run("--timeout", "1s", "nmt", "start", f"{NODE},{ABSENT}", "--confirm", exit=7)
    # durand does not answer SDO when it is stopped, as required.
    with Store(cangauge, directory, "durand"):
        assert silent("start", NODE) == [(None, "none")]
        for command in ("reset", "reset-comm"):
            assert nmt(command, NODE, "--confirm") == [(None, "boot-up")], command
        assert silent("stop", NODE) == [("stopped", "sdo")]
        assert silent("preop", NODE)[0][0] != "stopped"
        assert cangauge.run(*ONCE, "sdo", "read", NODE, "1000").out == "0\n"


def nmt_watch(cangauge, directory):
    """Boot-ups, state changes, the loss and the return of a device, in order."""
    with cangauge.running("nmt", "watch", "--format", "json", directory=directory) as watch:
        def seen():
            text = watch.text("out")
            lines = [json.loads(line) for line in text[:text.rfind("\n") + 1].splitlines()]
            events, state = [], None
            for event, state_now in [(line["event"], line["state"]) for line in lines if line["node"] == NODE]:
                # If the guest paused, a heartbeat is late: the node is lost and back, perhaps in another state.
                if event == "back" and events[-1] == ("lost", None):
                    events.pop()
                    event = "state" if state_now != state else None
                state = state_now or state
                events += [(event, state_now)] if event else []
            return events

        def await_seen(*events):
            """Waits for exactly these events."""
            wait_for(lambda: seen() == list(events), lambda: f"{seen()}\n{watch.text('err')}", watch.process)

        # A heartbeat of an extra node shows that it has opened the bus and watches.
        wait_for(lambda: sees(cangauge, watch), lambda: watch.text("err"), watch.process)
        story = [("boot-up", None), ("state", "pre-operational")]
        with Store(cangauge, directory, "canopen", "--heartbeat", "200") as store:
            await_seen(*story)
            for command, state in (("start", "operational"), ("stop", "stopped"), ("preop", "pre-operational")):
                cangauge.run("nmt", command, NODE, "--no-wait")
                story.append(("state", state))
                await_seen(*story)
            # The heartbeat period is known by now: the loss is reported without reading 1017h.
            store.kill()
            story.append(("lost", None))
            await_seen(*story)
        with Store(cangauge, directory, "canopen", "--heartbeat", "200"):
            wait_for(lambda: ("boot-up", None) in seen()[len(story) - 1:], lambda: f"{seen()}", watch.process)
        watch.finish(exit=None)


def sees(cangauge, watch):
    """Sends a heartbeat of a node that does not exist, and checks whether it was reported."""
    subprocess.run(["cansend", cangauge.interface, f"{0x700 + ABSENT:03X}#05"], check=True)
    time.sleep(0.05)
    return f'"node":{ABSENT}' in watch.text("out").replace(" ", "")


CHECKS = [python_canopen_device, durand_device, python_master_of_a_simulated_device,
          huge_transfers_of_a_simulated_device, after_refusals, after_ctrl_c, types, nmt_without_heartbeat, nmt_watch]


if __name__ == "__main__":
    sys.exit(run_checks(*sys.argv[1:3], [(check, ()) for check in CHECKS], sys.argv[3:]))
