"""Runs random scenarios with the real program: a seed selects devices, faults, a command, an interruption.

    scenarios.py [--seed N] [--count N] [--seconds N] [--verbose] [--command NAME] [--program-error NAME] BINARY HERE THERE

The simulated devices are on THERE and the program is on HERE. A relay between them makes the faults
(scenario/relay.py). When the command and all faults have ended, the devices are read from their own side and judged
(scenario/judge.py). The first seed is --seed, or else random and printed. The next scenarios use the seeds after it.

    tests/socketcan/vcan -t 900 -i vcan0,vcan1 target/peers/bin/python tests/peers/scenarios.py target/debug/cangauge vcan0 vcan1
"""

import argparse
import collections
import itertools
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import traceback

from scenario import judge
from scenario.foreign import Foreign
from scenario.make import Scenario
from scenario.probe import Probe
from scenario.recording import rows_of
from scenario.relay import Relay, stop
from scenario.wrong_program import PROGRAM_ERRORS

# No command takes longer if it gets some answers.
DEADLINE = 90
SHOWN_FRAMES = 60


class DeviceState:
    """The values and NMT states of the devices at one moment."""

    def __init__(self, objects, states):
        self.objects, self.states = objects, states


class Run:
    """The result of one run, for the judges."""

    exit, out, err, overran, configuring = None, "", "", False, []
    # The rows of a recording, and whether its last line is complete.
    rows, is_whole = [], True


class TestBed:
    """The program, the devices and the relay between them."""

    def __init__(self, binary, here, there, program_error=None):
        self.binary, self.here, self.there = os.path.abspath(binary), here, there
        self.relay, self.probe = Relay(here, there, program_error), Probe(there)

    def simulator(self, scenario, directory):
        """Starts the devices in a separate process."""
        bench = os.path.join(directory, "bench.toml")
        with open(bench, "w", encoding="ascii") as file:
            file.write(scenario.bench(os.path.join(directory, "truth.csv")))
        with open(os.path.join(directory, "simulator"), "w") as err:
            process = subprocess.Popen([self.binary, "--bus", self.there, "sim", bench], stderr=err, stdin=subprocess.DEVNULL)
        expected = sum(bool(device["node"]) for device in scenario.devices)
        booted = self.probe.boot_ups(expected)
        if len(booted) != expected:
            process.kill()
            raise RuntimeError(f"boot-ups only of {booted}: {open(err.name).read()}")
        return process

    def read_devices(self, scenario):
        """Reads the states first. A stopped node is then started, so that it answers SDO."""
        devices = list(scenario.devices)
        if scenario.command == "set-id":
            # One of the devices may have moved to this node-ID.
            devices += [{**device, "node": scenario.wanted["new"]} for device in devices if device["node"] in (scenario.named[0], None)
                        and not scenario.at(scenario.wanted["new"])]
        states = self.probe.states(devices)
        for node, state in states.items():
            if state == "stopped":
                self.probe.nmt(0x80, node)
        return DeviceState(self.probe.snapshot(devices), states)

    def events(self, scenario, simulator, program):
        """The events during the run, for the relay."""
        relay = self.relay
        acts = {"down": lambda _: relay.link("down"), "up": lambda _: relay.link("up"), "stopped": lambda _: stop(simulator, True),
                "continued": lambda _: stop(simulator, False), "power": relay.device_resets, "cut": lambda _: relay.cut(True),
                "joined": lambda _: relay.cut(False)}
        planned = [(at, lambda what=what, of=of: acts[what](of), f"{what} {of or ''}".strip()) for at, what, of in scenario.events]
        planned += [(at, lambda frame=frame: relay.rival_sends(*frame), "rival") for at, _, frame in scenario.rival]
        if scenario.signal:
            name, at = scenario.signal
            planned.append((at, lambda: program().send_signal(getattr(signal, name)), name))
        return planned

    def execute(self, scenario, simulator, directory, name):
        """Runs the command and waits for its end."""
        run, process = Run(), []
        paths = [os.path.join(directory, f"{name}.{end}") for end in ("out", "err", "csv")]
        line = [self.binary, "--bus", self.here, *scenario.line()]
        if scenario.wanted.get("file"):
            line += ["--output", paths[2]]
        clean = name != "run"
        self.relay.start_record([] if clean else scenario.faults, {} if clean else scenario.loss, scenario.seed,
                                [] if clean else self.events(scenario, simulator, lambda: process[0]))
        self.relay.open()
        with open(paths[0], "w") as out, open(paths[1], "w") as err:
            process.append(subprocess.Popen(line, stdout=out, stderr=err, stdin=subprocess.DEVNULL))
            started = time.monotonic()
            try:
                process[0].wait(0.25)
            except subprocess.TimeoutExpired:
                self.relay.start_clock()
                try:
                    process[0].wait(DEADLINE)
                except subprocess.TimeoutExpired:
                    run.overran = True
                    process[0].kill()
                    process[0].wait()
        run.exit, run.seconds = process[0].returncode, time.monotonic() - started
        self.calm(simulator)
        run.record, run.lines = list(self.relay.record), self.relay.lines()
        run.out, run.err = (open(path, encoding="utf-8", errors="replace").read() for path in paths[:2])
        if scenario.command == "log":
            table = run.out
            if scenario.wanted["file"]:
                table = open(paths[2], encoding="utf-8").read() if os.path.exists(paths[2]) else ""
            run.rows, run.is_whole = rows_of(table), table == "" or table.endswith("\n")
        return run

    def calm(self, simulator):
        """Ends all faults and waits for delayed frames."""
        self.relay.calm()
        stop(simulator, False)
        self.relay.link("up")
        until = time.monotonic() + 5
        while self.relay.delayed and time.monotonic() < until:
            time.sleep(0.02)
        # A device does not answer for 0.1 s after a reset.
        resets = any(identifier == 0 and data[:1] in (b"\x81", b"\x82") or kind and kind.startswith("power")
                     for _, _, kind, _, identifier, data in self.relay.record)
        time.sleep(0.25 if resets else 0.05)
        self.relay.close()

    def carry_out(self, scenario, directory):
        """Runs one scenario. Returns the run and the complaints."""
        simulator = self.simulator(scenario, directory)
        problems = []
        try:
            fresh = scenario.fresh = self.read_devices(scenario)
            for device in scenario.devices:
                if device["unsaved"] and device["node"]:
                    self.probe.write(device["node"], (0x1017, 0), device["unsaved"], 2)
            before = scenario.before = DeviceState(self.probe.snapshot(scenario.devices), fresh.states)
            run = self.execute(scenario, simulator, directory, "run")
            run.fresh, run.before = fresh, before
            run.configuring = self.probe.configuring()
            self.probe.leave_configuration()
            run.after = self.read_devices(scenario)
            with Foreign(self.there) as foreign:
                problems += with_failed_read("", judge.claim(scenario, run, foreign), foreign)
            if run.exit == -9:
                problems += self.again(scenario, simulator, directory, run)
            self.probe.reset(sum(bool(device["node"]) for device in scenario.devices))
            run.reset = DeviceState(self.probe.snapshot(scenario.devices), {})
            if run.exit == 0:
                with Foreign(self.there) as foreign:
                    problems += with_failed_read("after a reset: ", judge.claims.after_reset(scenario, run, foreign), foreign)
            problems += judge.judge(scenario, run)
        finally:
            simulator.send_signal(signal.SIGINT)
            simulator.wait(20)
        if scenario.command == "log":
            problems += judge.rows(scenario, run, rows_of(open(os.path.join(directory, "truth.csv"), encoding="utf-8").read()))
        return run, problems

    def again(self, scenario, simulator, directory, killed):
        """Runs the same command again without faults: it must succeed, or reject with a reason."""
        run = self.execute(scenario, simulator, directory, "again")
        run.before, run.after = killed.after, self.read_devices(scenario)
        with Foreign(self.there) as foreign:
            problems = with_failed_read("", judge.claim(scenario, run, foreign), foreign)
        if run.exit not in judge.EXITS - {5, 130} or "panicked" in run.err:
            problems.append(f"exit code {run.exit}: {run.err}")
        return [f"the same command again: {complaint}" for complaint in problems]


def with_failed_read(when, complaints, foreign):
    """The complaints, each with the reason of the last failed read of the judge."""
    trouble = f" ({foreign.trouble})" if foreign.trouble else ""
    return [f"{when}{complaint}{trouble}" for complaint in complaints]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--command", help="run only the seeds of this command")
    parser.add_argument("--program-error", choices=PROGRAM_ERRORS)
    parser.add_argument("binary")
    parser.add_argument("here")
    parser.add_argument("there")
    options = parser.parse_args()
    os.environ.update(LC_ALL="C", TERM="dumb")
    os.environ.pop("CANGAUGE_BUS", None)
    seed = options.seed if options.seed is not None else random.SystemRandom().randrange(1 << 32)
    count = options.count or (None if options.seconds else 1 if options.seed is not None else 100)
    print(f"from seed {seed}", flush=True)
    bed = TestBed(options.binary, options.here, options.there, PROGRAM_ERRORS.get(options.program_error))
    started, done, changed, failed, exits = time.monotonic(), 0, 0, [], collections.Counter()
    seeds = (each for each in itertools.count(seed) if options.command in (None, Scenario(each).command))
    while (count is None or done < count) and (options.seconds is None or time.monotonic() - started < options.seconds):
        scenario, since = Scenario(next(seeds)), time.monotonic()
        with tempfile.TemporaryDirectory() as directory:
            try:
                run, problems = bed.carry_out(scenario, directory)
            # An exception in a judge counts as a failure.
            except Exception:
                run, problems = None, [traceback.format_exc()]
        done += 1
        exits[scenario.command, run and run.exit] += 1
        changed += bool(bed.relay.changed_frames)
        if options.verbose:
            print(f"{scenario.seed} exit {run and run.exit} {time.monotonic() - since:.1f} s: {' '.join(scenario.arguments)}", flush=True)
        if problems:
            failed.append(scenario.seed)
            print(scenario)
            if run:
                print(f"exit {run.exit} after {run.seconds:.2f} s\n--- stdout\n{run.out[-2000:]}--- stderr\n{run.err}--- frames", *run.lines[-SHOWN_FRAMES:], sep="\n")
            print(*(f"BROKEN {scenario.seed}: {complaint}" for complaint in problems), sep="\n", flush=True)
    print(", ".join(f"{command} {code}: {number}" for (command, code), number in sorted(exits.items(), key=str)))
    print(f"{done} scenarios from seed {seed} in {time.monotonic() - started:.0f} s, {len(failed)} failed {failed or ''}")
    if options.program_error:
        print(f"{options.program_error}: frames changed in {changed} scenarios")
    bed.relay.end()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
