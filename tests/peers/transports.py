"""One table of operations gives the same results on the simulated bus, socketcand and slcan. With INTERFACE, only this
interface is compared with the simulated bus.

The other ends are independent of cangauge:

- the socketcand client of python-can uses the server of cangauge;
- a socketcand bridge written with python-can serves the client of cangauge;
- slcan of python-can and an adapter written from the command set use pseudo terminals.

    transports.py PROGRAM [INTERFACE]
"""

import contextlib
import os
import pty
import re
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
import tty
from concurrent.futures import ThreadPoolExecutor

import can

from harness import Cangauge, wait_for

DEVICES = ["mh4@1:pressure=2.5bar", "d20@2", "dps@127:pressure=14psi", "mc1609@3", "dps@9"]
# Each uses its own node, because the simulated bus starts afresh with each command.
OPERATIONS = [
    ("scan",),
    ("read", "1", "pressure"),
    ("sdo", "read", "2", "0x1008"),
    ("sdo", "read", "4", "0x1008", "--block", "always"),
    ("sdo", "write", "3", "0x1017", "1000"),
    ("sdo", "read", "1", "0x5FFF"),
    ("pdo", "map", "127", "1", "pressure"),
    ("store", "2"),
    ("nmt", "reset", "3"),
    ("log", "1", "pressure", "--sync", "50ms", "--count", "5"),
    ("check", "127", "pressure < 1 psi", "--for", "500ms", "--poll", "50ms"),
    ("lss", "set-id", "9", "12"),
    ("log", "1", "--passive", "--device", "mh4", "--duration", "200ms"),
]


def plain(text):
    """A text without times and their differences."""
    text = re.sub(r"\d{4}-\d\d-\d\dT[\d:.]+Z,[\d.]+", "TIME", text)
    text = re.sub(r"\bn \d+, \d+ outside", "all outside", text)
    return re.sub(r"\b\d+(\.\d+)? (us|ms|s)\b|\b[\d.]+/s\b", "N", text)


def results(program, bus, operations=OPERATIONS):
    cangauge = Cangauge(program, bus)
    found = []
    for operation in operations:
        done = cangauge.run(*operation, exit=None)
        found.append((" ".join(operation), done.exit, plain(done.out)))
    return found


def compare(name, found, expected):
    for one, other in zip(found, expected):
        assert one == other, f"{name}: {one}\non the simulated bus: {other}"
    print(f"ok   {name}: {len(found)} operations", flush=True)


@contextlib.contextmanager
def served(program, directory):
    """Simulated devices as a socketcand server. Yields the port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    err = os.path.join(directory, f"{port}.err")
    with open(err, "w") as file:
        process = subprocess.Popen([program, "sim", *DEVICES, "--listen", str(port)], stderr=file, stdin=subprocess.DEVNULL)
    try:
        wait_for(lambda: "simulation is running" in open(err).read(), lambda: open(err).read(), process)
        yield port
    finally:
        process.terminate()
        assert process.wait() == 0


def client(port):
    return can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="can0")


def ask(bus, node, *request):
    """An SDO answer to python-can."""
    bus.send(can.Message(arbitration_id=0x600 + node, data=bytes(request).ljust(8, b"\0"), is_extended_id=False))
    until = time.monotonic() + 20
    while time.monotonic() < until:
        message = bus.recv(1)
        if message and message.arbitration_id == 0x580 + node:
            return bytes(message.data)
    raise AssertionError("no answer")


class Thread(threading.Thread):
    """A thread that ends with the block."""

    def __init__(self):
        super().__init__(daemon=True)
        self.is_over = False

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.is_over = True
        self.join()


class Bridge(Thread):
    """A socketcand server in front of a bus of python-can, written from the protocol's document. It sends its text
    in arbitrary pieces."""

    def __init__(self, bus):
        super().__init__()
        self.bus, self.listener = bus, socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]

    def run(self):
        self.listener.settimeout(0.1)
        while not self.is_over:
            with contextlib.suppress(TimeoutError, OSError):
                self.serve(self.listener.accept()[0])

    def serve(self, stream):
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while self.bus.recv(0):
            pass
        text, is_raw = "", False
        stream.sendall(b"< hi >")
        while not self.is_over:
            if select.select([stream], [], [], 0 if is_raw else 0.05)[0]:
                received = stream.recv(999)
                if not received:
                    return
                text += received.decode()
            while ">" in text:
                words, text = text[: text.index(">")].strip("< ").split(), text[text.index(">") + 1 :]
                if words[0] == "send":
                    data = bytes(int(word, 16) for word in words[3:])
                    assert len(data) == int(words[2])
                    extended = len(words[1]) == 8
                    self.bus.send(can.Message(arbitration_id=int(words[1], 16), is_extended_id=extended, data=data))
                else:
                    is_raw |= words[0] == "rawmode"
                    stream.sendall(b"< ok >")
            message = self.bus.recv(0.001) if is_raw else None
            if message:
                name = f"{message.arbitration_id:0{8 if message.is_extended_id else 3}X}"
                line = f"< frame {name} {message.timestamp:.6f} {message.data.hex().upper()} >".encode()
                cut = len(line) * 2 // 3
                stream.sendall(line[:cut])
                stream.sendall(line[cut:])


class Adapter(Thread):
    """A serial adapter in front of a bus of python-can, written from the command set of the LAWICEL adapters."""

    def __init__(self, bus, end=b"\r", mute=False):
        super().__init__()
        self.bus, self.end, self.mute = bus, end, mute
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        self.path, self.slave = os.ttyname(slave), slave
        self.is_open = self.has_stamps = False

    def run(self):
        text = b""
        while not self.is_over:
            if select.select([self.master], [], [], 0 if self.is_open else 0.05)[0]:
                text += os.read(self.master, 999)
            while b"\r" in text:
                line, text = text.split(b"\r", 1)
                answer = self.command(line.decode())
                if not self.mute:
                    os.write(self.master, answer)
            message = self.bus.recv(0.001) if self.is_open else None
            if message and not message.is_error_frame:
                kind, digits = ("T", 8) if message.is_extended_id else ("t", 3)
                stamp = f"{int(message.timestamp * 1000) % 60000:04X}" if self.has_stamps else ""
                line = f"{kind}{message.arbitration_id:0{digits}X}{message.dlc}{message.data.hex().upper()}{stamp}\r"
                os.write(self.master, line.encode())

    def command(self, line):
        if line[:1] in ("t", "T"):
            digits = 3 if line[0] == "t" else 8
            data = bytes.fromhex(line[2 + digits :])
            assert len(data) == int(line[1 + digits]), line
            self.bus.send(can.Message(arbitration_id=int(line[1 : 1 + digits], 16), is_extended_id=digits == 8, data=data))
            return b"z" + self.end
        if line in ("V", "N", "F"):
            return {"V": b"V1013", "N": b"NA123", "F": b"F00"}[line] + self.end
        if line in ("O", "L", "C"):
            self.is_open = line != "C"
            while self.is_open and self.bus.recv(0):
                pass
        self.has_stamps |= line == "Z1"
        return b"\x07" if line == "v" else self.end


class Wire(Thread):
    """Passes frames between two buses of python-can."""

    def __init__(self, *buses):
        super().__init__()
        self.buses = buses

    def run(self):
        def move(source, target):
            while not self.is_over:
                message = source.recv(0.1)
                if message and not message.is_error_frame:
                    message.channel = None
                    target.send(message)

        first, second = self.buses
        other = threading.Thread(target=move, args=(second, first), daemon=True)
        other.start()
        move(first, second)
        other.join()


def two_clients(port):
    """python-can as a client of our server, twice: both reach the devices and see each other."""
    with client(port) as one, client(port) as two:
        assert ask(one, 1, 0x40, 0x00, 0x10) == bytes.fromhex("4300100094018200"), "1000h of mh4"
        one.send(can.Message(arbitration_id=0x18FF0001, is_extended_id=True, data=b"\x01\xa0"))
        until = time.monotonic() + 20
        seen = []
        while time.monotonic() < until and not any(message.is_extended_id for message in seen):
            seen += [message for message in [two.recv(1)] if message]
        assert (seen[-1].arbitration_id, bytes(seen[-1].data)) == (0x18FF0001, b"\x01\xa0")
    print("ok   python-can's socketcand client: two at once", flush=True)


def round_trip(program, bus):
    """The time of one SDO read, from the trace of a program that reads the same object many times."""
    with tempfile.TemporaryDirectory() as directory:
        trace = os.path.join(directory, "trace")
        for _ in range(3):
            Cangauge(program, bus).run("--trace", trace, "sdo", "read", "1", "0x1000")
        lines = [line.split() for line in open(trace)]
        times = [float(time.strip("()")) for time, _, frame in lines if frame.startswith(("601#40", "581#"))]
        return (times[-1] - times[-2]) * 1000


def block_device(program, directory):
    """A description of a device with block transfer; the built-in ones have none."""
    text = subprocess.run([program, "devices", "show", "mh4"], capture_output=True, text=True, check=True).stdout
    path = os.path.join(directory, "block.toml")
    with open(path, "w") as file:
        file.write(text.replace("[sdo]\n", "[sdo]\nblock = true\n"))
    return path


def main(program, interface=None):
    directory = tempfile.mkdtemp()
    DEVICES.append(f"{block_device(program, directory)}@4")
    sim = "sim:" + ",".join(DEVICES)
    expected = results(program, sim)
    exits = dict((operation, code) for operation, code, _ in expected)
    assert exits["check 127 pressure < 1 psi --for 500ms --poll 50ms"] == 1 and list(exits.values()).count(0) == 10, exits
    times = {"sim": round_trip(program, sim)}

    # They mostly wait, so they run side by side. With an interface, only it is compared.
    with ThreadPoolExecutor() as pool:
        checks = () if interface else (our_server, bridge, adapter, unplugged_adapter, mute_adapter, foreign_adapter)
        running = [pool.submit(check, program, directory, expected, times) for check in checks]
        for one in running:
            one.result()
    if interface:
        with Cangauge(program, interface).running("sim", *DEVICES, directory=directory) as simulator:
            simulator.await_words("simulation is running")
            compare(f"SocketCAN, {interface}", results(program, interface), expected)
            times[interface] = round_trip(program, interface)
        kernel_adapter(program, directory, expected)
    print("one SDO read: " + ", ".join(f"{name} {time:.2f} ms" for name, time in times.items()))


def our_server(program, directory, expected, times):
    with served(program, directory) as port:
        bus = f"socketcand://127.0.0.1:{port}/can0"
        compare("socketcand, our server", results(program, bus), expected)
        times["socketcand"] = round_trip(program, bus)
        two_clients(port)


def bridge(program, directory, expected, times):
    with served(program, directory) as port, client(port) as behind, Bridge(behind) as server:
        bus = f"socketcand://127.0.0.1:{server.port}/can0"
        compare("socketcand, a bridge of python-can", results(program, bus), expected)


def adapter(program, directory, expected, times):
    with served(program, directory) as port, client(port) as behind, Adapter(behind) as device:
        bus = f"slcan:{device.path}@250k"
        compare("slcan, an adapter from the command set", results(program, bus), expected)
        times["slcan"] = round_trip(program, bus)


def unplugged_adapter(program, directory, expected, times):
    """The adapter is unplugged during log, and plugged in again as another terminal with the same name."""
    name = os.path.join(directory, "ttyACM0")
    command = [program, "-b", f"slcan:{name}@250k", "log", "127", "pressure", "--poll", "100ms", "--duration", "8s"]
    with served(program, directory) as port:
        with client(port) as behind, Adapter(behind) as device:
            os.symlink(device.path, name)
            log = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            before = [log.stdout.readline() for _ in range(10)]
        os.close(device.master)
        os.close(device.slave)
        os.remove(name)
        time.sleep(1)
        with client(port) as behind, Adapter(behind) as device:
            os.symlink(device.path, name)
            after, notes = log.communicate(timeout=60)
    rows = [line.split(",") for line in before + after.splitlines()][1:]
    times = [float(row[1]) for row in rows if row[4]]
    gap, end = max((right - left, right) for left, right in zip(times, times[1:]))
    after = sum(time >= end for time in times)
    assert log.returncode == 0 and 1 < gap < 6 and after > 10, (log.returncode, gap, times, notes)
    assert "the interface went down" in notes and "the interface is up again" in notes, notes
    print(f"ok   slcan, an adapter that is unplugged: a gap of {gap:.1f} s")


# Each command waits for 2.5 s until such an adapter counts as silent.
FEW = [operation for operation in OPERATIONS if operation[0] in ("scan", "store", "log") and "--passive" not in operation]


def few(expected):
    return [one for one in expected if one[0] in [" ".join(operation) for operation in FEW]]


def mute_adapter(program, directory, expected, times):
    with served(program, directory) as port, client(port) as behind, Adapter(behind, b"\r\n", mute=True) as device:
        found = results(program, f"slcan:{device.path}@250k", FEW)
        compare("slcan, an adapter that answers nothing", found, few(expected))


def foreign_adapter(program, directory, expected, times):
    ends = [pty.openpty() for _ in range(2)]
    for _, slave in ends:
        tty.setraw(slave)
    (master, path), (other_master, other) = ends
    with served(program, directory) as port, client(port) as behind:
        with can.Bus(interface="slcan", channel=os.ttyname(path), bitrate=250000, sleep_after_open=0) as foreign:
            with Wire(foreign, behind), Cable(master, other_master):
                found = results(program, f"slcan:{os.ttyname(other)}@250k", FEW)
                compare("slcan, python-can's slcan", found, few(expected))


def kernel_adapter(program, directory, expected):
    """The kernel's slcan driver, with simulated devices on its interface."""
    ends = [pty.openpty() for _ in range(2)]
    for _, slave in ends:
        tty.setraw(slave)
    (master, path), (other_master, other) = ends
    # The guest of tests/socketcan/vcan has its modules there.
    module = f"/usr/lib/uml/modules/{os.uname().release}/kernel/drivers/net/can/slcan/slcan.ko"
    subprocess.run(["insmod", module], check=True)
    command = ["slcand", "-F", "-o", "-s5", os.ttyname(path), "slcan9"]
    with Cable(master, other_master):
        driver = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        try:
            up = ["ip", "link", "set", "slcan9", "up"]
            wait_for(lambda: subprocess.run(up, stderr=subprocess.DEVNULL).returncode == 0, lambda: "no slcan9", driver)
            with Cangauge(program, "slcan9").running("sim", *DEVICES, directory=directory) as simulator:
                simulator.await_words("simulation is running")
                found = results(program, f"slcan:{os.ttyname(other)}@250k", FEW)
                compare("slcan, the kernel's driver", found, few(expected))
        finally:
            driver.terminate()
            driver.wait()


class Cable(Thread):
    """Joins two pseudo terminals."""

    def __init__(self, *ends):
        super().__init__()
        self.ends = ends

    def run(self):
        while not self.is_over:
            for end in select.select(self.ends, [], [], 0.1)[0]:
                with contextlib.suppress(OSError):
                    os.write(self.ends[self.ends.index(end) ^ 1], os.read(end, 999))


if __name__ == "__main__":
    main(*sys.argv[1:])
