"""Disturbs the program: kills, stops, full disks, two writers, rotations by others, clock steps, held locks.

    STRESS_SECONDS=60 STRESS_SEED=1 tests/socketcan/vcan -t 300 python3 tests/socketcan/stress.py BINARY vcan0

The rows of a recording must be frames of candump with the same times, and no frame may be missing between the first
and the last row. No command runs longer than its deadline and one second.
"""

import collections
import contextlib
import glob
import os
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

BENCH = """device = [
    { kind = "mh4", node = 5, start = true, set = { "0x1800:2" = 254, "0x1800:5" = 10, "0x1801:1" = 0xC0000285 } },
    { kind = "mh4", node = 6, set = { "0x1017" = 700 } },
]"""
SETTINGS = 'heartbeat = "300ms"\n[tpdo.1]\nevent-timer = "250ms"\n[tpdo.2]\nevent-timer = "350ms"\n'
DISK = 65536
# After this time the machine counts as hung.
GIVE_UP = 120


class Stress:
    def __init__(self, binary, interface, folder, rng):
        self.binary, self.interface, self.folder, self.rng = os.path.abspath(binary), interface, folder, rng
        self.state, self.candump = os.path.join(folder, "state"), os.path.join(folder, "candump.log")
        self.environment = {"PATH": os.environ["PATH"], "XDG_STATE_HOME": self.state, "LC_ALL": "C"}
        self.counts, self.failures = collections.Counter(), []

    def start(self):
        """How long several commands need at present to start on this machine."""
        started = time.monotonic()
        subprocess.run([self.binary, "devices"], stdout=subprocess.DEVNULL, check=True)
        return 10 * (time.monotonic() - started)

    def popen(self, *words):
        return subprocess.Popen([self.binary, "-b", self.interface, *map(str, words)], env=self.environment, text=True,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def end(self, process, limit, *exits):
        """Waits for the end of a command, at most `limit` + 1 seconds plus the start-up time."""
        for seconds in (limit + 1, 0):  # The machine may have become slow: measure again.
            with contextlib.suppress(subprocess.TimeoutExpired):
                out, err = process.communicate(timeout=seconds + self.start())
                break
        else:
            process.kill()
            raise AssertionError(f"{process.args[3:]} takes longer than {limit} s: {process.communicate()}")
        assert process.returncode in exits and "panicked" not in err, \
            f"{process.args[3:]}: exit {process.returncode}, expected {exits}\n{out}{err}"
        return out, err

    def run(self, *words, limit=10):
        return self.end(self.popen(*words), limit, 0)

    def check(self, rows, path):
        """The rows are frames of candump without a gap."""
        give_up, frames = time.monotonic() + GIVE_UP, []
        while rows and rows[-1] not in frames and time.monotonic() < give_up:
            time.sleep(0.1)
            with open(self.candump, encoding="ascii") as file:
                frames = re.findall(r"^ *\(([-\d]+) ([:.\d]+)\) +\S+ +185 +\[5\] +((?:\w\w ){4})", file.read(), re.M)
            frames = [(f"{day}T{hour}Z", data.replace(" ", "")) for day, hour, data in frames]
        first = frames.index(rows[0]) if rows and rows[0] in frames else 0
        assert rows == frames[first : first + len(rows)], f"{path}: other frames from {rows[0]} to {rows[-1]}"

    def log(self, path, *more):
        return self.popen("log", 5, "pressure", "--passive", "--device", "mh4", "-o", path, *more)

    def await_rows(self, path, count, process):
        give_up = time.monotonic() + GIVE_UP
        while len(rows_of(path)[0]) < count:
            assert process.poll() is None and time.monotonic() < give_up, f"{path}: no {count} rows {process.poll()}"
            time.sleep(0.02)

    def signals(self, path):
        """A signal at any moment; the next recording continues the file."""
        sent = self.rng.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
        process = self.log(path, "--summary", f"{path}.json", *self.rng.choice([[], ["--duration", "20s"]]))
        time.sleep(self.rng.uniform(0, self.start() / 5))
        if self.rng.random() < 0.3:
            process.send_signal(signal.SIGSTOP)
            time.sleep(self.rng.uniform(0, 1))
            process.send_signal(signal.SIGCONT)
        process.send_signal(sent)
        # A signal that arrives before the program handles signals ends the program. The exit code is then negative.
        self.end(process, 0, *((-sent,) if sent == signal.SIGKILL else (-sent, 0, 3, 130)))
        rows, is_whole = rows_of(path)
        assert is_whole or sent == signal.SIGKILL, f"{path}: the last line is cut off"
        if os.path.exists(f"{path}.json") and (text := open(f"{path}.json", encoding="ascii").read()):
            assert f'"rows":{len(rows)},' in text, f"{path}: {len(rows)} rows, {text}"
        self.end(self.log(path, "--append", "--count", 40), 5, 0)
        again, is_whole = rows_of(path)
        assert is_whole and again[: len(rows)] == rows and len(again) == len(rows) + 40, f"{path}: not continued"
        self.check(rows, path)
        self.check(again[len(rows):], path)

    def stops(self, path):
        """The program is stopped and continued. It ends in time, and receives the frames that the kernel kept."""
        process = self.log(path, "--duration", "2s")
        time.sleep(self.start() / 5)
        for _ in range(self.rng.randint(1, 4)):
            process.send_signal(signal.SIGSTOP)
            time.sleep(self.rng.uniform(0, 0.2))
            process.send_signal(signal.SIGCONT)
        self.end(process, 2, 0, 3)
        self.check(rows_of(path)[0], path)

    def full_disk(self, path):
        """A full disk: complete rows, and the true cause."""
        disk = os.path.dirname(path)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK}", "none", disk], check=True)
        try:
            with open(f"{path}.other", "wb") as other:
                other.write(bytes(self.rng.randrange(DISK * 3 // 4, DISK)))
            _, err = self.end(self.log(path, "--duration", "20s"), 20, 8)
            rows, is_whole = rows_of(path)
            assert "No space left on device" in err and is_whole, f"{is_whole} {err}"
            self.check(rows, path)
        finally:
            subprocess.run(["umount", disk], check=True)

    def two_writers(self, path):
        """The second writer of a file is refused, under each name of the file."""
        process = self.log(path)
        self.await_rows(path, 1, process)
        self.rng.choice([os.symlink, os.link])(path, other := f"{path}.other")
        _, err = self.end(self.log(self.rng.choice([path, other]), self.rng.choice(["--append", "--force"])), 5, 2)
        assert f"is being written by process {process.pid}" in err, err
        process.terminate()
        self.end(process, 0, 0)
        rows, is_whole = rows_of(path)
        self.check(rows, path)
        assert is_whole, f"{path}: the last line is cut off"

    def rotation(self, path):
        """Another program moves the file, or copies and truncates it."""
        process, is_moved = self.log(path, "--count", 200), self.rng.random() < 0.5
        self.await_rows(path, self.rng.randint(1, 100), process)
        if is_moved:
            os.rename(path, f"{path}.old")
        else:
            subprocess.run(["cp", path, f"{path}.old"], check=True)
            os.truncate(path, 0)
        self.end(process, 10, 0)
        old, _ = rows_of(f"{path}.old")
        self.check(old, path)
        if is_moved:
            assert len(old) == 200, len(old)
            return
        self.check(rows_of(path)[0], path)
        with open(path, encoding="ascii") as file:
            assert file.readline().startswith("time,"), f"{path}: no header"

    def clock_steps(self, path):
        """The clock of the system is set during a recording."""
        process = self.log(path, "--duration", "3s")
        self.await_rows(path, 5, process)
        for step in (86400, -2 * 86400, 86400):
            time.clock_settime(time.CLOCK_REALTIME, time.time() + step)
            time.sleep(0.2)
        self.end(process, 3, 0)
        self.check(rows_of(path)[0], path)

    def held_lock(self, _):
        """Another process holds the lock and accepts no connection. SIGTERM ends the wait, `--ignore-lock` skips it."""
        with socket.socket(socket.AF_UNIX) as holder:
            holder.bind(f"\0cangauge/{self.interface}/{self.rng.choice(['6', 'all'])}")
            holder.listen(self.rng.choice([0, 1]))
            processes = [self.popen("read", 6, "pressure") for _ in range(3)]
            self.run("read", 6, "pressure", "--ignore-lock")
            processes[0].terminate()
            self.end(processes[0], 0, -signal.SIGTERM, 130, 5)
            for process in processes[1:]:
                _, err = self.end(process, 10, 5)
                assert str(os.getpid()) in err, err

    def killed_probe(self, _):
        """`nmt state --probe` is killed. The next run restores 1017h."""
        self.kill("nmt", "state", 6, "--probe")
        self.run("nmt", "state", 6)
        out, err = self.run("sdo", "read", 6, "0x1017")
        assert out == "700\n", out + err

    def killed_apply(self, path):
        """`config apply` is killed. `--rollback` restores the old values of the device."""
        before, _ = self.run("config", "dump", 6, limit=20)
        for name, text in ((path, SETTINGS), (f"{path}.old", before)):
            with open(name, "w", encoding="utf-8") as file:
                file.write(text)
        self.kill("config", "apply", 6, path)
        is_left = bool(glob.glob(f"{self.state}/*/*.toml"))
        # Without a journal it was killed before the first write or after the last one.
        self.run("config", "apply", 6, "--rollback" if is_left else f"{path}.old", limit=20)
        self.counts["rollback"] += is_left
        after, _ = self.run("config", "dump", 6, limit=20)
        assert after == before, f"{before}\n---\n{after}"

    def kill(self, *words):
        """Kills a command after one of its first writes."""
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as wire:
            wire.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", 0x606, 0x7FF))
            wire.bind((self.interface,))
            wire.settimeout(0.1)
            process, left = self.popen(*words), self.rng.randint(1, 2)
            while left and process.poll() is None:
                with contextlib.suppress(TimeoutError):
                    left -= wire.recv(16)[8] >> 5 == 1
            process.kill()
            process.communicate()

    def work(self, kinds, until):
        while time.monotonic() < until and not self.failures:
            kind = self.rng.choice(kinds)
            try:
                kind(os.path.join(tempfile.mkdtemp(dir=self.folder), "run.csv"))
                self.counts[kind.__name__] += 1
            except Exception as error:  # The first failure ends the run.
                self.failures.append(f"{kind.__name__}: {type(error).__name__}: {error}")


def rows_of(path):
    """The rows of a recording, and whether its last line is complete."""
    text = open(path, encoding="ascii").read() if os.path.exists(path) else ""
    return re.findall(r"^([-\dT:.]+Z),.*,0x(\w{8})\w*\n", text, re.M), text == "" or text.endswith("\n")


def main():
    (binary, interface), seed = sys.argv[1:3], int(os.environ.get("STRESS_SEED", random.randrange(10**9)))
    print(f"seed {seed}", flush=True)
    # In memory: on the file system of the guest, two hard links look like two files.
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        stress = Stress(binary, interface, folder, random.Random(seed))
        with open(os.path.join(folder, "bench.toml"), "w", encoding="ascii") as file:
            file.write(BENCH)
        with open(stress.candump, "w", encoding="ascii") as record:
            candump = subprocess.Popen(["candump", "-t", "A", "-r", "4000000", interface], stdout=record,
                                       env={**os.environ, "TZ": "UTC"})
        simulator = stress.popen("sim", file.name)
        simulator.stderr.readline()
        until = time.monotonic() + float(os.environ.get("STRESS_SECONDS", 60))
        recordings = [stress.signals, stress.stops, stress.full_disk, stress.two_writers, stress.rotation]
        others = [stress.held_lock, stress.killed_probe, stress.killed_apply]
        threads = [threading.Thread(target=stress.work, args=(kinds, until)) for kinds in (recordings, others)]
        for act in (threading.Thread.start, threading.Thread.join):
            for thread in threads:
                act(thread)
        stress.work([stress.clock_steps], time.monotonic() + 1)
        for process in (simulator, candump):
            process.terminate()
            process.wait(10)
        print(", ".join(f"{count} {name}" for name, count in sorted(stress.counts.items())))
        assert not stress.failures, "\n".join(stress.failures)


if __name__ == "__main__":
    main()
