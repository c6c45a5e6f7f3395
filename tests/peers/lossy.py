"""The program on a wire that loses, doubles and delays frames and flips bits. The devices use python-canopen and durand.

    lossy.py [--operations N] [--seconds N] [--percent P] [--only-loss] [--seed N] [--verbose] BINARY HERE THERE

Each device has one worker, which runs one random command after the other. The devices are in this process, so the
result is compared with their own objects and states. Exit code 0 is an error if the device has a different value or
state, unless a data byte without CRC was flipped. A command that failed is run again without faults: it must
succeed and leave no journal.

    tests/socketcan/vcan -t 900 -i vcan0,vcan1 target/peers/bin/python tests/peers/lossy.py --seconds 60 target/debug/cangauge vcan0 vcan1
"""

import argparse
import collections
import glob
import heapq
import json
import logging
import os
import random
import subprocess
import sys
import tempfile
import threading
import time

import canopen
from canopen import objectdictionary as od

import device
from dictionary import variable
from harness import Cangauge, PATIENT
from scenario.relay import IN, OUT, Relay, text
from transfers import NODE as STORE_NODE, Store

KINDS = ("lose", "double", "delay", "flip")
LONGEST_DELAY = 0.1
DEADLINE = 60
TEXT = "a text that needs several segments"
STATES = {"start": "OPERATIONAL", "preop": "PRE-OPERATIONAL", "stop": "STOPPED"}
# A failure on the lossy wire; not usage (2), a file (8) or Ctrl-C.
FAILURES = {1, 3, 4, 5, 6, 7}


class Lossy(Relay):
    """A relay that disturbs this percentage of the frames. The faults of each node are kept until a worker reads
    them."""

    def __init__(self, here, there, percent, kinds, seed):
        self.percent, self.kinds, self.rng = percent, kinds, random.Random(seed)
        self.faults_of, self.undisturbed_nodes, self.counts = collections.defaultdict(list), set(), collections.Counter()
        super().__init__(here, there)

    def _pass(self, direction, identifier, data):
        node = data[1] & 0x7F if identifier == 0 and data and len(data) > 1 else identifier & 0x7F
        is_disturbed = node not in self.undisturbed_nodes and self.rng.random() * 100 < self.percent
        kind, at, sent = self.rng.choice(self.kinds) if is_disturbed else None, time.monotonic(), data
        if kind == "flip" and data:
            place, bit = self.rng.randrange(len(data)), 1 << self.rng.randrange(8)
            sent = data[:place] + bytes([data[place] ^ bit]) + data[place + 1 :]
        elif kind == "delay":
            at += self.rng.uniform(0.002, LONGEST_DELAY)
        self.counts[kind] += 1
        if kind:
            self.faults_of[node].append((kind, direction, identifier, data, sent))
        for _ in range({"lose": 0, "double": 2}.get(kind, 1)):
            if kind == "delay":
                heapq.heappush(self.delayed, (at, next(self.ticket), direction, identifier, sent))
            else:
                self._send(direction, identifier, sent)


def is_data(direction, identifier, data, sent):
    """Whether the flipped bit is in a data byte that is not protected by a CRC. The number of bytes in a segment to a
    device counts as data: the device could compare the total with the announced size, but the client cannot."""
    place = next(at for at, pair in enumerate(zip(data, sent)) if pair[0] != pair[1])
    if identifier & 0x780 not in (0x580, 0x600):
        return True
    if data[0] >> 5 == 0:
        return place > 0 or direction == OUT and (data[0] ^ sent[0]) & 0x0E != 0
    return bool(data[0] & 2) and place > 3 if direction == IN else True


class Operation:
    """A command line. After exit code 0, `truth` checks the run and returns an error text or None."""

    def __init__(self, words, truth, is_verified=False):
        self.words, self.truth, self.is_verified = [str(word) for word in words], truth, is_verified


class Worker(threading.Thread):
    def __init__(self, test, node, rng):
        super().__init__(daemon=True)
        self.test, self.node, self.rng = test, node, rng

    def run(self):
        while self.test.goes_on():
            try:
                self.reset()
                self.carry_out(self.rng.choice(self.operations())())
            # A failure of the test itself ends the test.
            except Exception as error:
                self.test.complain(self.node, [], f"{type(error).__name__}: {error}", [])
                raise

    def command(self, operation, *options):
        words = [self.test.binary, "--bus", self.test.here, *options, *operation.words]
        started = time.monotonic()
        done = subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE, stdin=subprocess.DEVNULL, env=self.test.environment)
        self.test.seconds[operation.words[0]] += time.monotonic() - started
        return done

    def carry_out(self, operation):
        relay, name = self.test.relay, " ".join(word for word in operation.words[:4] if word.isalpha() and word not in ("f", "json"))
        relay.faults_of[self.node].clear()
        done = self.command(operation)
        faults = list(relay.faults_of[self.node])
        self.test.results[name, done.returncode] += 1
        complaints = []
        flips = [fault[1:] for fault in faults if fault[0] == "flip" and fault[3] and is_data(*fault[1:])]
        if done.returncode and self.test.verbose:
            print(f"{' '.join(operation.words)}: exit {done.returncode} {done.stderr.strip()}", flush=True)
        if done.returncode == 0 and (false := operation.truth(done)):
            if any(flip[0] == IN or not operation.is_verified for flip in flips):
                self.test.results[name, "flipped data"] += 1
            else:
                complaints.append(f"false: {false}")
        elif done.returncode == 2 and "no valid answer" in done.stderr:
            pass  # Without the device type (1000h), the types of the signals are unknown. The note names 1000h.
        elif done.returncode == 2 and any(flip[0] == IN for flip in flips):
            self.test.results[name, "other device"] += 1  # With another device type or mapping, it looks like another device.
        elif done.returncode not in FAILURES | {0} or "panicked" in done.stderr:
            complaints.append("not a failure of the wire")
        # A delayed frame would disturb the next command.
        time.sleep(LONGEST_DELAY)
        if done.returncode or complaints:
            relay.undisturbed_nodes.add(self.node)
            again = self.command(operation, *PATIENT)
            if again.returncode == 3 and self.restarts():
                self.test.results[name, "restarted device"] += 1
                again = self.command(operation, *PATIENT)
            # `pdo map` restores what it has read before, with the changed bit.
            is_misread = operation.words[:2] == ["pdo", "map"] and any(flip[0] == IN and flip[2][0] >> 5 == 2 for flip in flips)
            if is_misread and not again.returncode:
                self.test.results[name, "flipped data"] += 1
            elif again.returncode or (false := operation.truth(again)):
                complaints.append(f"again, calm: exit {again.returncode} {again.stdout}{again.stderr}{false if not again.returncode else ''}")
            relay.undisturbed_nodes.discard(self.node)
            if left := self.left():
                complaints.append(f"left behind: {left}")
        for complaint in complaints:
            self.test.complain(self.node, operation.words, f"exit {done.returncode}: {complaint}\n{done.stdout}{done.stderr}", faults)

    def restarts(self):
        """Whether the device had to be restarted."""
        return False

    def left(self):
        """The journals of this node."""
        names = [f"_{key}{end}" for key in (f"node{self.node}", 1000 + self.node) for end in "._"]
        return [path for path in glob.glob(f"{self.test.state}/*/*") if any(name in path for name in names)]


class Sensor(Worker):
    """A measuring device made with python-canopen."""

    def __init__(self, test, node, kind, rng, network):
        super().__init__(test, node, rng)
        arguments = argparse.Namespace(sync=0, period=100, heartbeat=rng.choice((0, 60)), record=None)
        self.kind = device.KINDS[kind]
        self.device = device.Device(network, node, self.kind, arguments, None)
        self.local = self.device.node
        self.heartbeat = arguments.heartbeat
        self.device.boot()
        threading.Thread(target=device.run_timer, args=(self.device, threading.Event()), daemon=True).start()

    def reset(self):
        with self.device.lock:
            self.local.data_store.clear()
            self.device.configured = False
            self.device.number = self.rng.randrange(1000) // 8 * 8
        self.local.nmt.state = self.rng.choice(("PRE-OPERATIONAL", "PRE-OPERATIONAL", "OPERATIONAL"))
        self.local.nmt.start_heartbeat(self.heartbeat) if self.heartbeat else self.local.nmt.stop_heartbeat()
        self.state = self.local.nmt.state

    def held(self, index, sub=0):
        return bytes(self.local.get_data(index, sub))

    def number(self, index, sub=0):
        return int.from_bytes(self.held(index, sub), "little")

    def printed(self, expected):
        return lambda done: done.stdout != expected and f"{done.stdout!r}, not {expected!r}"

    def holds(self, index, sub, value):
        raw = value if isinstance(value, bytes) else value.to_bytes(len(self.held(index, sub)), "little")
        return lambda _: self.held(index, sub) != raw and f"{index:04X}:{sub} is {self.held(index, sub)}, not {raw}"

    def physical(self):
        """The values that the device can have sent, as the program prints them."""
        return {f"{self.kind.physical(number):.3f}" for number in range(device.WRAP)}

    def operations(self):
        return [self.expedited, self.segmented, self.several, self.value, self.write, self.write, self.write_text, self.verified,
                self.nmt, self.nmt_state, self.probe, self.scan, self.show, self.map, self.poll, self.log, self.check, self.apply, self.info]

    def expedited(self):
        index, value = self.rng.choice((("1018:4", 1000 + self.node), ("1018:1", 0x1234), ("2000", 0xBEEF), ("1017", self.heartbeat)))
        return Operation(["sdo", "read", self.node, index, *(["--type", "u16"] if index == "2000" else [])], self.printed(f"{value}\n"))

    def segmented(self):
        return Operation(["sdo", "read", self.node, "1008"], self.printed(f"{self.kind.name}\n"))

    def several(self):
        def truth(done):
            rows = {row["object"]: row["value"] for row in map(json.loads, done.stdout.splitlines())}
            wanted = {"0x1018:4": 1000 + self.node, "0x1008:0": self.kind.name, "0x6132:1": self.kind.digits}
            return rows != wanted and f"{rows}, not {wanted}"

        return Operation(["-f", "json", "sdo", "read", self.node, "1018:4", "1008", "6132:1"], truth)

    def is_true(self, value, status):
        """Whether the device may have measured this."""
        return value is None or status == "invalid" or f"{float(value):.3f}" in self.physical()

    def value(self):
        def truth(done):
            row = json.loads(done.stdout)
            return not self.is_true(row["value"], row["status"]) and f"no such value: {row}"

        return Operation(["-f", "json", "read", self.node, "ch1"], truth)

    def write(self):
        value = self.rng.randrange(0x10000)
        return Operation(["sdo", "write", self.node, "2000", value, "--type", "u16"], self.holds(0x2000, 0, value))

    def write_text(self):
        return Operation(["sdo", "write", self.node, "2001", TEXT, "--type", "vs"], self.holds(0x2001, 0, TEXT.encode()))

    def verified(self):
        value = self.rng.randrange(100, 1000)
        return Operation(["sdo", "write", self.node, "1800:5", value, "--type", "u16", "--verify"], self.holds(0x1800, 5, value), True)

    def nmt(self):
        command = self.rng.choice(("start", "preop", "reset", "stop") if self.heartbeat else ("start", "preop", "reset"))

        def truth(done):
            state, now = json.loads(done.stdout)["state"], self.local.nmt.state
            return state not in (None, now.lower()) and f"{state}, not {now}"

        return Operation(["-f", "json", "nmt", command, self.node], truth)

    def nmt_state(self, *options):
        def truth(done):
            state = json.loads(done.stdout)["state"]
            if self.number(0x1017) != self.heartbeat:
                return f"1017h is {self.number(0x1017)}"
            return state not in (None, self.local.nmt.state.lower()) and f"{state}, not {self.local.nmt.state}"

        return Operation(["-f", "json", "nmt", "state", self.node, *options], truth, bool(options))

    def probe(self):
        return self.nmt_state("--probe")

    def scan(self):
        def truth(done):
            (row,) = map(json.loads, done.stdout.splitlines())
            wanted = {"node": self.node, "device_type": "0x00020194", "vendor": 0x1234, "product": self.kind.product,
                      "serial": 1000 + self.node, "name": self.kind.name, "state": self.local.nmt.state.lower()}
            return any(row[name] not in (None, value) for name, value in wanted.items()) and f"{row}"

        return Operation(["-f", "json", "scan", self.node], truth)

    def show(self):
        def truth(done):
            row = json.loads(done.stdout)
            objects = [entry["object"] for entry in row["mapping"]]
            wanted = [f"0x{self.kind.index:04X}:1"] + (["0x6150:1"] if self.kind.index == 0x6130 else [])
            found = row["cob_id"], row["valid"], row["event_timer_ms"], objects
            return found != (f"0x{0x180 + self.node:03X}", True, 100, wanted) and f"{row}"

        return Operation(["-f", "json", "pdo", "show", self.node, 1], truth)

    def map(self):
        timer, number = self.rng.randrange(20, 500), self.kind.index << 16 | 0x120

        def truth(_):
            entries = [self.number(0x1A00, sub) for sub in range(1, self.number(0x1A00) + 1)]
            found = self.number(0x1800, 1) & 0x800007FF, self.number(0x1800, 5), entries
            return found != (0x180 + self.node, timer, [number]) and f"{found}"

        return Operation(["pdo", "map", self.node, 1, f"0x{self.kind.index:04X}:1/32", "--event-timer", f"{timer}ms"], truth, True)

    def rows(self, done):
        rows = [json.loads(line) for line in done.stdout.splitlines()]
        wrong = [row for row in rows if row["signal"] == "ch1" and not self.is_true(row["value"], row["status"])]
        return wrong and f"{wrong}"

    def poll(self):
        return Operation(["-f", "json", "log", self.node, "--poll", "50ms", "--count", 4], self.rows)

    def log(self):
        def truth(done):
            return self.rows(done) or self.local.nmt.state != self.state and self.heartbeat and f"state {self.local.nmt.state}, not {self.state}"

        return Operation(["-f", "json", "log", self.node, "--count", 6, "--start"], truth)

    def check(self):
        return Operation(["check", self.node, "ch1 < 100000"], lambda _: None) if self.kind.name.endswith("switch") else self.value()

    def apply(self):
        time, timer = self.rng.randrange(100, 200), self.rng.randrange(50, 400)
        path = os.path.join(self.test.folder, f"{self.node}.toml")
        with open(path, "w", encoding="ascii") as file:
            file.write(f'[node]\nheartbeat = "{time}ms"\n[tpdo.1]\nevent-timer = "{timer}ms"\n')

        def truth(_):
            found = self.number(0x1017), self.number(0x1800, 5)
            return found != (time, timer) and f"{found}, not {time, timer}" or self.left() and f"left behind: {self.left()}"

        return Operation(["config", "apply", self.node, path], truth, True)

    def info(self):
        def truth(done):
            row = json.loads(done.stdout)
            wanted = {"vendor": 0x1234, "product": self.kind.product, "serial": 1000 + self.node, "name": self.kind.name}
            return any(row.get(name) not in (None, value) for name, value in wanted.items()) and f"{row}"

        return Operation(["-f", "json", "info", self.node], truth)


class Blocks(Worker):
    """A device made with durand: block transfer with CRC."""

    def __init__(self, test, rng):
        super().__init__(test, STORE_NODE, rng)
        self.start_store()

    def start_store(self):
        self.store = Store(Cangauge(self.test.binary, self.test.there), self.test.folder, "durand").__enter__()

    def restarts(self):
        """After a corrupted request, durand may stay in a block upload that was not requested."""
        self.store.kill()
        self.start_store()
        return True

    def reset(self):
        self.store.write(0x2000, self.rng.randbytes(self.rng.choice((4, 30, 60, 100))))

    def operations(self):
        return [self.upload, self.download]

    def path(self, name):
        return os.path.join(self.test.folder, name)

    def upload(self):
        path = self.path("up")
        if os.path.exists(path):
            os.remove(path)

        def truth(_):
            with open(path, "rb") as file:
                data = file.read()
            os.remove(path)
            return data != self.store.read(0x2000) and f"{data} read, not {self.store.read(0x2000)}"

        return Operation(["sdo", "read", self.node, "2000", "--type", "d", "--output", path, "--block", "always"], truth, True)

    def download(self):
        data = self.rng.randbytes(self.rng.choice((4, 30, 60, 100)))
        with open(self.path("down"), "wb") as file:
            file.write(data)
        truth = lambda _: self.store.read(0x2000) != data and f"{self.store.read(0x2000)} held, not {data}"
        return Operation(["sdo", "write", self.node, "2000", "--input", self.path("down"), "--block", "always"], truth, True)


class Test:
    def __init__(self, options, folder):
        self.binary, self.here, self.there, self.folder = os.path.abspath(options.binary), options.here, options.there, folder
        self.state, self.verbose = os.path.join(folder, "state"), options.verbose
        self.environment = {"PATH": os.environ["PATH"], "XDG_STATE_HOME": self.state, "LC_ALL": "C"}
        self.count, self.operations, self.until = 0, options.operations, time.monotonic() + (options.seconds or 1e9)
        self.results, self.seconds, self.complaints, self.lock = collections.Counter(), collections.Counter(), [], threading.Lock()

    def goes_on(self):
        with self.lock:
            self.count += 1
            return self.count <= self.operations and time.monotonic() < self.until

    def complain(self, node, words, complaint, faults):
        lines = [f"    {kind} {direction} {text(identifier, data)} {text(identifier, sent) if sent != data else ''}"
                 for kind, direction, identifier, data, sent in faults]
        with self.lock:
            self.complaints.append(words)
            print(f"BROKEN node {node}: {' '.join(words)}\n{complaint}", *lines, sep="\n", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--operations", type=int, default=10**9)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--percent", type=float, default=4)
    parser.add_argument("--only-loss", action="store_true")
    parser.add_argument("--verbose", action="store_true", help="also print the failures")
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1 << 32))
    parser.add_argument("binary")
    parser.add_argument("here")
    parser.add_argument("there")
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    logging.disable()
    network = canopen.Network()
    network.connect(interface="socketcan", channel=options.there)
    with tempfile.TemporaryDirectory() as folder:
        test = Test(options, folder)
        test.relay = Lossy(options.here, options.there, options.percent, KINDS[:1] if options.only_loss else KINDS, options.seed)
        rngs = (random.Random(f"{options.seed} {number}") for number in range(9))
        kinds = ((10, "real32"), (11, "integer"), (12, "real32"), (13, "integer"))
        workers = [Sensor(test, node, kind, next(rngs), network) for node, kind in kinds] + [Blocks(test, next(rngs))]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        workers[-1].store.__exit__()
        test.relay.end()
    network.disconnect()
    rows = collections.defaultdict(dict)
    for (name, result), number in sorted(test.results.items(), key=str):
        rows[name][result] = number
    for name, results in rows.items():
        print(f"{name:16} {results}")
    done = {code: sum(number for (_, result), number in test.results.items() if result == code) for code in (0, *FAILURES)}
    total, failed = sum(done.values()), sum(done.values()) - done[0]
    print(f"{total} operations, {failed} failed ({100 * failed / max(1, total):.1f} %); frames {dict(test.relay.counts)}; "
          f"{len(test.complaints)} complaints")
    # With the default of one retry, at most one command in ten may fail at 3 %.
    is_too_many = options.only_loss and options.percent <= 3 and total >= 500 and failed * 10 > total
    return 1 if test.complaints or is_too_many or not total else 0


if __name__ == "__main__":
    sys.exit(main())
