"""Garbage, a second master, heavy traffic, a full transmit queue and a lost link. None of them changes measured
values or time-outs."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time

from harness import GIVE_UP, HERE, PATIENT, Wire, begins, devices, measured, rows_of, stands_in, wait_for
from recording import SIMULATED, write_bench

# python-canopen devices with their TPDOs: identifier and length.
FOREIGN = ("10:real32", "11:integer", "12:overload")
FOREIGN_TPDOS = {(0x18A, 5), (0x18B, 4), (0x18C, 5)}
SIMULATED_TPDOS = {(0x181, 5), (0x281, 5), (0x182, 4), (0x1FF, 4)} | {(code + 3, 8) for code in (0x180, 0x280, 0x380, 0x480)}


def harms(identifier, data, nodes):
    """Whether a device of `nodes` may act on the frame. Then it is not garbage."""
    first = data[0] if data else 0
    if identifier == 0x000:
        return first in (1, 2, 128, 129, 130) and (len(data) < 2 or data[1] in {0, *nodes})
    if identifier & 0x780 == 0x600 and identifier & 0x7F in nodes:
        # The request of a download.
        return first >> 5 in (1, 6)
    # LSS requests.
    return identifier == 0x7E5 and 0 < first < 0x60


def garbage(nodes, tpdos, without=()):
    """Frames of each length with each identifier, (identifier, data), except valid ones: a frame with the
    identifier and length of a TPDO *is* that TPDO, from any sender."""
    rng = random.Random(1)
    fillings = (lambda length: bytes(length), lambda length: b"\xff" * length, rng.randbytes)
    for identifier in range(0x800):
        # Each identifier once; those of the nodes, of a neighbour and of a missing node more often.
        for filling in fillings if identifier & 0x7F in {0, 13, *nodes} else [rng.randbytes]:
            for length in range(9):
                data = filling(length)
                if (identifier, length) not in tpdos and identifier not in without and not harms(identifier, data, nodes):
                    yield identifier, data


def pour(interface, nodes, tpdos, without=()):
    """Sends the garbage, and frames similar to TPDOs of the nodes."""
    with Wire(interface) as wire:
        for number, (identifier, data) in enumerate(garbage(nodes, tpdos, without)):
            wire.send(identifier, data)
            # Gives the other processes some time.
            if number % 200 == 0:
                time.sleep(0.005)
        for identifier, length in tpdos:
            for data in (bytes(length), b"\xff" * length):
                wire.send(identifier | Wire.EXTENDED, data)
                wire.send(identifier | 0x1ABCD << 11 | Wire.EXTENDED, data)
                for flags in (0, 1, 3):
                    wire.send_fd(identifier, data, flags)
                    wire.send_fd(identifier | Wire.EXTENDED, data, flags)
        for node in nodes:
            for code in range(0, 0x800, 0x80):
                for length in range(9):
                    wire.send(code + node | Wire.REMOTE, length=length)
                    wire.send(code + node | Wire.REMOTE | Wire.EXTENDED, length=length)
                    wire.send_fd(code + node, bytes(8 * length))
        # Bus errors of each class, as a controller reports them.
        for kind in range(10):
            for detail in (0, 0xFF):
                wire.send(1 << kind | Wire.ERROR, bytes([detail] * 8))


def survives(recording, rows=20):
    """Checks that rows are still written."""
    recording.await_rows(len(recording.rows()) + rows)
    assert recording.is_running()


def garbage_while_recording(cangauge, directory):
    nodes = {10, 11, 12}
    with devices(cangauge.interface, directory, *FOREIGN, quiet=True) as record:
        with cangauge.running("log", "10-12", directory=directory) as log:
            log.await_rows(10)
            pour(cangauge.interface, nodes, FOREIGN_TPDOS)
            survives(log)
            result = log.finish()
        rows = measured(result.rows())
        # The garbage contains boot-ups. TPDOs of a node are ignored until it was read again.
        for node in nodes:
            stands_in([row for row in rows if row[0] == str(node)], record(node))
    assert " 0 frames dropped" in result.err, result


def garbage_while_sending_sync(cangauge, directory):
    """Simulated devices. Garbage with the identifier of SYNC makes them send, which is correct."""
    record = os.path.join(directory, "truth.csv")
    with cangauge.simulator(write_bench(directory, record), directory) as simulator:
        cangauge.run("scan", "1-3,127", "--timeout", "5s")
        with cangauge.running("log", "1-3,127", "--sync", "20ms", directory=directory) as log:
            log.await_rows(10)
            pour(cangauge.interface, {1, 2, 3, 127}, SIMULATED_TPDOS)
            survives(log)
            result = log.finish()
        simulator.finish()
    with open(record, encoding="ascii") as file:
        stands_in(measured(result.rows()), measured(rows_of(file.read())))
    assert " 0 frames dropped" in result.err, result


def garbage_while_polling(cangauge, directory):
    """Invalid SDO answers. (Requests to the same nodes belong to a second master: see below.) The devices miss
    frames under this load, so some requests are repeated."""
    with devices(cangauge.interface, directory, "10:real32", "11:integer", quiet=True):
        with cangauge.running("--timeout", "500ms", "--retries", "20", "log", "10,11", "--poll", "20ms", directory=directory) as log:
            log.await_rows(10)
            pour(cangauge.interface, {10, 11}, FOREIGN_TPDOS, without={0x60A, 0x60B})
            survives(log)
            rows = measured(log.finish().rows())
    assert {row[:5] for row in rows} == {("10", "ch1", "-100", "bar", "ok"), ("11", "ch1", "-5", "psi", "ok")}, set(rows)


def garbage_while_listening(cangauge, directory):
    """--passive, which uses only received frames."""
    record = os.path.join(directory, "truth.csv")
    with cangauge.simulator(write_bench(directory, record), directory) as simulator:
        cangauge.run("scan", "127", "--timeout", "5s")
        with cangauge.running("log", "127", "--passive", "--device", "dps", directory=directory) as log:
            # It sends nothing. Its first row shows that it listens.
            while not log.rows():
                cangauge.run("nmt", "start", "127", "--no-wait")
                assert log.is_running(), log.text("err")
            log.await_rows(5)
            pour(cangauge.interface, {127}, SIMULATED_TPDOS)
            survives(log)
            result = log.finish()
        simulator.finish()
    with open(record, encoding="ascii") as file:
        sent = measured(rows_of(file.read()), 127)
    rows = measured(result.rows())
    begins(rows, sent[sent.index(rows[0]):])


@contextlib.contextmanager
def rival(interface, *nodes):
    """Starts a second master that reads the same nodes."""
    command = [sys.executable, os.path.join(HERE, "rival.py"), interface, *map(str, nodes)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout.readline() == "reading\n", "rival.py reads nothing"
        yield
        assert process.poll() is None, "rival.py has ended"
    finally:
        process.terminate()
        out, _ = process.communicate(timeout=GIVE_UP)
    count = int(out.split()[0])
    print(f"       the other master: {out.strip()}")
    assert count > 100, f"the rival read only {count} times"


def second_master(cangauge, directory):
    """Two masters on one SDO channel: no wrong value, and expedited reads always succeed."""
    def rounds(count, *arguments):
        return [cangauge.run("--timeout", "5s", *arguments, exit=None) for _ in range(count)]

    name = "python-canopen pressure transmitter\n"
    with devices(cangauge.interface, directory, "10:real32", "11:integer") as record:
        with rival(cangauge.interface, 10):
            for object, text in (("1018:1", "4660\n"), ("1018:4", "1010\n"), ("1000", "131476\n"), ("1017", "0\n")):
                for result in rounds(20, "sdo", "read", 10, object):
                    assert (result.exit, result.out) == (0, text), result
            results = rounds(20, "sdo", "read", 10, "1008")
            # Two segmented transfers on one server: an error is allowed, a wrong value is not.
            assert all(result.out == (name if result.exit == 0 else "") for result in results), [str(r) for r in results]
            print(f"       segmented: {sum(result.exit == 0 for result in results)} of {len(results)}")
            for r in results:
                if r.exit or r.seconds > 1: print(r)
            assert any(result.exit == 0 for result in results), [str(r) for r in results]
            for result in rounds(10, "read", 10, "ch1"):
                assert result.out == ("-100\n" if result.exit == 0 else ""), result
            with cangauge.running("--timeout", "5s", "log", "10,11", "--poll", "20ms", directory=directory) as log:
                log.await_rows(100)
                rows = measured(log.finish().rows())
            assert {row[:5] for row in rows} == {("10", "ch1", "-100", "bar", "ok"), ("11", "ch1", "-5", "psi", "ok")}, set(rows)
            assert not record()
            with cangauge.running("--timeout", "5s", "log", "10,11", directory=directory) as log:
                log.await_rows(50)
                rows = measured(log.finish().rows())
            for node in (10, 11):
                begins([row for row in rows if row[0] == str(node)], record(node))


@contextlib.contextmanager
def traffic(interface, *arguments):
    """Runs cangen without pauses."""
    process = subprocess.Popen(["cangen", interface, "-g", "0", "-i", *arguments], stdin=subprocess.DEVNULL)
    try:
        yield process
        assert process.poll() is None, "cangen has ended"
    finally:
        process.terminate()
        process.wait(GIVE_UP)


def heavy_traffic(cangauge, directory):
    """Continuous traffic at the limit of one CPU does not delay deadlines. If it did, these commands would not
    end."""
    # Unrelated frames; TPDOs; answers of the requested node to another request.
    for arguments in (["-I", "123", "-L", "8"], ["-I", "1CD", "-L", "8"], ["-I", "5CD", "-L", "8", "-D", "4300100111223344"]):
        with traffic(cangauge.interface, *arguments):
            for command in (["sdo", "read", 77, "1000"], ["log", 77], ["read", 77]):
                result = cangauge.run(*command, "--timeout", "300ms", exit=3)
                assert 0.6 <= result.seconds < GIVE_UP / 2, result
    with devices(cangauge.interface, directory, "10:real32") as record, traffic(cangauge.interface, "-I", "123", "-L", "8"):
        assert cangauge.run(*PATIENT, "sdo", "read", 10, "1018:1").out == "4660\n"
        assert cangauge.run(*PATIENT, "sdo", "read", 10, "1008").out == "python-canopen pressure transmitter\n"
        with cangauge.running(*PATIENT, "log", 10, directory=directory) as log:
            log.await_rows(20)
            begins(measured(log.finish().rows()), record(10))


@contextlib.contextmanager
def slow_queue(interface, rate, limit):
    """Sets a short transmit queue and a slow bus."""
    subprocess.run(["tc", "qdisc", "replace", "dev", interface, "root", "tbf", "rate", rate, "burst", "100", "limit",
                    str(16 * limit)], check=True)
    try:
        yield lambda: subprocess.run(["tc", "-s", "qdisc", "show", "dev", interface], check=True, capture_output=True,
                                     text=True).stdout
    finally:
        subprocess.run(["tc", "qdisc", "del", "dev", interface, "root"], check=True)


def full_queue(cangauge, directory, here, there):
    """127 requests through a queue of ten frames: all nodes are found, though the queue was full at times."""
    nodes = list(range(20, 120))
    bench = ",".join(f"{kind}@{node}" for kind, node in zip(["mh4", "dps", "d20", "mc1609"] * 25, nodes))
    with devices(there, directory, "10:real32", "11:integer"), cangauge.simulator(bench, directory, bus=there):
        fast = cangauge.run("scan", "--format", "json", "--timeout", "3s", bus=here).json()
        assert [node["node"] for node in fast] == [10, 11, *nodes]
        with slow_queue(here, "32kbit", 10) as statistics:
            slow = cangauge.run("scan", "--format", "json", "--timeout", "3s", bus=here).json()
            refused = int(statistics().split("(dropped ")[1].split(",")[0])
        assert slow == fast, (slow, fast)
        assert refused > 0, "the queue was never full"
        print(f"       refused by the queue: {refused} frames")
        # The queue never empties: no node acknowledges.
        with slow_queue(here, "8bit", 2):
            result = cangauge.run("scan", exit=5, bus=here)
            assert "transmit queue is full" in result.err and "acknowledge" in result.err, result


def log_survives_frames_without_acknowledgement(cangauge, directory, here, there):
    """The cable is unplugged for a while: log reports it and continues afterwards."""
    with devices(there, directory, "10:real32", sync=1) as record:
        with cangauge.running("log", 10, "--sync", "20ms", directory=directory, bus=here) as log:
            log.await_rows(10)
            with slow_queue(here, "8bit", 2):
                log.await_words("node 10: silent")
                # Long enough for the time-out of the queue on any machine.
                time.sleep(2)
                assert log.is_running(), log.text("err")
            survives(log)
            result = log.finish()
        assert "node 10 is back" in result.err, result
        begins(measured(result.rows()), record())


def link(interface, state):
    subprocess.run(["ip", "link", "set", interface, state], check=True)


def link_lost(cangauge, directory, here, there):
    """The interface goes down and up during a recording. Only frames sent in between are missing, log reports it,
    and the exit code is 0."""
    for arguments in ([], ["--sync", "20ms"], ["--poll", "20ms"]):
        sync = ["--sync"] == arguments[:1]
        with devices(there, directory, "10:real32", sync=1 if sync else 0) as record:
            with cangauge.running("--timeout", "1s", "log", 10, *arguments, directory=directory, bus=here) as log:
                log.await_rows(10)
                link(here, "down")
                try:
                    log.await_words("the interface went down")
                    assert log.is_running()
                finally:
                    link(here, "up")
                log.await_words("the interface is up again")
                survives(log)
                result = log.finish()
            rows = measured(result.rows())
            if arguments[:1] == ["--poll"]:
                assert {row[:5] for row in rows} == {("10", "ch1", "-100", "bar", "ok")}, set(rows)
                continue
            # All values are unique, so each row has one place in the record. There must be one gap.
            sent = record()
            places = [sent.index(row) for row in rows]
            holes = [place for place, following in zip(places, places[1:]) if following != place + 1]
            assert places[0] == 0 and places == sorted(places) and len(holes) <= 1, (arguments, places)
    # The interface is down from the start: nothing is recorded.
    link(here, "down")
    try:
        result = cangauge.run("log", 10, exit=5, bus=here)
        assert f"{here} is down" in result.err and result.out == "", result
        result = cangauge.run("sdo", "read", 10, "1000", exit=5, bus=here)
    finally:
        link(here, "up")


CHECKS = [garbage_while_recording, garbage_while_sending_sync, garbage_while_polling, garbage_while_listening, second_master,
          heavy_traffic]
# These need two interfaces that are the ends of one bus.
PAIR_CHECKS = [full_queue, log_survives_frames_without_acknowledgement, link_lost]
