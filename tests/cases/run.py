#!/usr/bin/env python3
"""Runs command lines of cangauge against odd devices and compares exit codes and texts with the table.

    tests/socketcan/vcan -i case0,case1 tests/cases/run.py PROGRAM case0,case1 [SCENE...]
    tests/cases/run.py --list

Each interface has one scene at a time. The scenes are the classes of values.py, nodes.py, silence.py and transfers.py.
"""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
import nodes  # noqa: E402, F401
import silence  # noqa: E402, F401
import transfers  # noqa: E402, F401
import values  # noqa: E402, F401
from table import SCENES  # noqa: E402

# The default node-ID of the DPS is 127.
NODES = {"DpsUnderload": 127, "DpsOverload": 127, "DpsEmergency": 127, "Answers60": 127}
# A line that runs longer counts as hung.
LIMIT = 60


def check(case, program, interface, node, directory):
    """Runs one line; the text of the failure, or None."""
    line = case.line.format(node=node, dir=directory)
    command = f"{program} {line}"
    environment = os.environ | {"CANGAUGE_BUS": interface}
    try:
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=LIMIT,
                              stdin=subprocess.DEVNULL, env=environment)
    except subprocess.TimeoutExpired:
        return f"{line}: still running after {LIMIT} s"
    wrong = [f"exit {case.exit}"] if done.returncode != case.exit else []
    wrong += [f"on stdout: {pattern}" for pattern in case.out if not re.search(pattern, done.stdout)]
    wrong += [f"on stderr: {pattern}" for pattern in case.err if not re.search(pattern, done.stderr)]
    wrong += [f"not: {pattern}" for pattern in case.never if re.search(pattern, done.stdout + done.stderr)]
    rows = len(done.stdout.splitlines()) - 1
    wrong += [f"{case.rows} rows"] if case.rows is not None and rows != case.rows else []
    if not wrong:
        return None
    got = "".join(f"    | {text}\n" for text in (done.stdout + done.stderr).splitlines()[:20])
    return f"{line}\n    expected {', '.join(wrong)}\n{got}    | exit {done.returncode}"


def play(name, program, interface):
    """Runs one scene; its failures."""
    scene, node = SCENES[name], NODES.get(name, 5)
    device = scene(interface, node)
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        device.run()
    # Its socket is open in the child only.
    del device
    with tempfile.TemporaryDirectory() as directory:
        failures = [check(case, program, interface, node, directory) for case in scene.cases]
    ended, _ = os.waitpid(child, os.WNOHANG)
    if ended:
        return ["the device failed"]
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return [failure for failure in failures if failure]


def work(scenes, program, interface):
    """Runs scenes one after another; the exit code."""
    failed = 0
    for name in scenes:
        started = time.monotonic()
        failures = play(name, program, interface)
        failed |= bool(failures)
        text = f"{'FAIL' if failures else 'ok'} {name} ({time.monotonic() - started:.1f} s)\n"
        sys.stdout.write(text + "".join(f"  {failure}\n" for failure in failures))
        sys.stdout.flush()
    return failed


def main():
    if sys.argv[1:] == ["--list"]:
        for name, device in SCENES.items():
            print(f"{name:26}{device.__doc__.splitlines()[0]}")
        return 0
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, interfaces = os.path.abspath(sys.argv[1]), sys.argv[2].split(",")
    scenes = sys.argv[3:] or list(SCENES)
    workers = []
    for number, interface in enumerate(interfaces):
        worker = os.fork()
        if worker == 0:
            code = work(scenes[number::len(interfaces)], program, interface)
            os._exit(code)
        workers.append(worker)
    failed = any([os.waitpid(worker, 0)[1] for worker in workers])
    print(f"{len(scenes)} scenes: {'failures above' if failed else 'all passed'}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
