"""cangauge against foreign devices and masters on real SocketCAN.

    cangauge.py BINARY IFACE [A:B] [NAME...]

Python-canopen devices (device.py) and the program's own simulated ones are read, recorded and
disturbed; python-canopen (master.py) reads the simulated ones. A:B are two ends of one wire (vxcan),
which are taken down and slowed down; without them the checks that need them are skipped. Names pick
single checks. tests/socketcan/vcan provides the interfaces:

    tests/socketcan/vcan -i vcan0,vx0:vx1 target/peers/bin/python tests/peers/cangauge.py target/debug/cangauge vcan0 vx0:vx1
"""

import os
import sys
import tempfile
import time
import traceback

import commands
import disturbance
import recording
from harness import Cangauge


def main():
    binary, interface, *rest = sys.argv[1:]
    pair = rest.pop(0).split(":") if rest and ":" in rest[0] else None
    checks = [(check, ()) for check in commands.CHECKS + recording.CHECKS + disturbance.CHECKS]
    if pair:
        checks += [(check, pair) for check in disturbance.PAIR_CHECKS]
    else:
        print("SKIPPED: checks that need the two ends of a wire (A:B)")
    names = {check.__name__ for check, _ in checks}
    assert set(rest) <= names, f"there are: {', '.join(sorted(names))}"
    os.environ.update(LC_ALL="C", TERM="dumb")
    os.environ.pop("CANGAUGE_BUS", None)
    cangauge = Cangauge(os.path.abspath(binary), interface)
    passed, failed = 0, []
    for check, arguments in checks:
        if rest and check.__name__ not in rest:
            continue
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as directory:
            try:
                check(cangauge, directory, *arguments)
                passed += 1
                word = "ok    "
            # Whatever went wrong, the next check is made.
            except Exception:
                traceback.print_exc(file=sys.stdout)
                failed.append(check.__name__)
                word = "FAILED"
        print(f"{word} {check.__name__} ({time.monotonic() - begun:.1f} s)", flush=True)
    if failed:
        print(f"failed: {', '.join(failed)}")
    print(f"{passed} passed, {len(failed)} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
