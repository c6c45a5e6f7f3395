"""cangauge against foreign devices and masters on real SocketCAN.

    cangauge.py BINARY IFACE [A:B] [NAME...]

Reads, records and disturbs python-canopen devices (device.py) and simulated devices. python-canopen (master.py) reads
the simulated devices. A:B are two ends of one wire (vxcan), which are taken down and slowed down. Without A:B the checks
that need them are skipped. NAME selects single checks. tests/socketcan/vcan provides the interfaces:

    tests/socketcan/vcan -i vcan0,vx0:vx1 target/peers/bin/python tests/peers/cangauge.py target/debug/cangauge vcan0 vx0:vx1
"""

import sys

import commands
import disturbance
import keeping
import mapping
import profiles
import recording
from harness import run_checks


def main():
    binary, interface, *rest = sys.argv[1:]
    pair = rest.pop(0).split(":") if rest and ":" in rest[0] else None
    checks = [(check, ()) for check in commands.CHECKS + keeping.CHECKS + mapping.CHECKS + profiles.CHECKS + recording.CHECKS + disturbance.CHECKS]
    if pair:
        checks += [(check, pair) for check in disturbance.PAIR_CHECKS]
    else:
        print("SKIPPED: checks that need the two ends of a wire (A:B)")
    return run_checks(binary, interface, checks, rest)


if __name__ == "__main__":
    sys.exit(main())
