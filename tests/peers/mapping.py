"""pdo with python-canopen devices, and python-canopen's own PDO configuration with the simulated ones."""

import contextlib
import json

import canopen
from canopen import objectdictionary as od

import dictionary as known
from harness import GIVE_UP, PATIENT, devices


def settings(cangauge, node, *more):
    """The TPDOs of a node, as `pdo show` prints them."""
    return cangauge.run(*PATIENT, "pdo", "show", node, *more, "--format", "json").json()


def pdo_show(cangauge, directory):
    with devices(cangauge.interface, directory, "10:real32", "11:integer", period=50):
        assert settings(cangauge, 10) == [{
            "node": 10, "pdo": 1, "cob_id": "0x18A", "valid": True, "rtr": False, "transmission": "timer",
            "event_timer_ms": 50, "inhibit_us": 0,
            "mapping": [{"object": "0x6130:1", "bits": 32, "signal": "ch1", "unit": "bar"},
                        {"object": "0x6150:1", "bits": 8, "signal": "ch1.status", "unit": None}],
        }]
        only = settings(cangauge, 11, 1)[0]["mapping"]
        assert [(entry["object"], entry["bits"]) for entry in only] == [("0x9130:1", 32)], only
        cangauge.run(*PATIENT, "pdo", "show", 10, 2, exit=4)


def after(done):
    """The TPDOs in the report of `pdo map`, without the facts about the command."""
    facts = ("writes", "stored", "notes")
    return [{key: value for key, value in pdo.items() if key not in facts} for pdo in done.json()]


def pdo_map(cangauge, directory):
    def change(*arguments, **options):
        return cangauge.run(*PATIENT, "pdo", "map", 10, 1, *arguments, "--format", "json", **options)

    def watch(seconds="1s"):
        """The first rows."""
        result = cangauge.run(*PATIENT, "pdo", "watch", 10, "--duration", seconds, "--format", "json").json()
        return [value["signal"] for value in result[0]["values"]], result[0]["values"][0]

    with devices(cangauge.interface, directory, "10:real32", "11:integer", period=50) as record:
        delivered = settings(cangauge, 10)
        # Reverse the mapping and send slower. The new TPDO is decoded with it.
        done = change("ch1.status", "ch1", "--event-timer", "40ms")
        assert after(done) == settings(cangauge, 10), done
        assert [entry["object"] for entry in done.json()[0]["mapping"]] == ["0x6150:1", "0x6130:1"], done
        assert done.json()[0]["event_timer_ms"] == 40 and done.json()[0]["valid"], done
        cangauge.run(*PATIENT, "nmt", "start", 10)
        signals, value = watch()
        assert signals == ["ch1"] and (value["unit"], value["status"]) == ("bar", "ok"), value
        assert value["value"] in [float(row[2]) for row in record(10)], value
        # Change the identifier in OPERATIONAL. Nothing else changes.
        moved = change("--cob-id", "0x3A5")
        assert moved.json()[0]["cob_id"] == "0x3A5" and moved.json()[0]["rtr"] is False, moved
        assert watch()[0] == ["ch1"]
        # Identifiers that the other device or this one uses.
        for taken in ("0x18B", "0x8A", "0x80"):
            refused = change("--cob-id", taken, exit=1)
            assert "is used by" in refused.err and settings(cangauge, 10) == after(moved), refused
        again = change("ch1.status", "ch1", "--transmission", "timer", "--inhibit", "0")
        assert after(again) == after(moved), again
        # Five entries are too many: the device rejects one, and the old mapping is restored.
        refused = change("ch1.status", "ch1.status", "ch1.status", "ch1.status", "ch1.status", exit=4)
        error = json.loads(refused.err)["error"]
        assert (error["object"], error["abort"]) == ("0x1A00:5", "0x06090011"), error
        assert error["message"].endswith("TPDO1 has its old mapping and parameters"), error
        assert settings(cangauge, 10) == after(moved)
        assert watch()[0] == ["ch1"]
        # Restore the factory defaults.
        change("ch1", "ch1.status", "--event-timer", "50ms", "--cob-id", "0x18A")
        assert settings(cangauge, 10) == delivered


@contextlib.contextmanager
def master(interface, node, tpdos, types):
    """The node in python-canopen."""
    network = canopen.Network()
    network.connect(interface="socketcan", channel=interface)
    try:
        dictionary = od.ObjectDictionary()
        for entry in known.remote_device(types).values():
            # Only the TPDOs that the device has.
            if not 0x1800 <= entry.index < 0x1C00:
                dictionary.add_object(entry)
        dictionary.add_object(known.array("AI input FV", 0x7100, od.INTEGER16))
        for number in range(1, tpdos + 1):
            dictionary.add_object(next(known.communication(number)))
            dictionary.add_object(known.mapping(number))
        remote = canopen.RemoteNode(node, dictionary)
        # A busy machine answers late.
        remote.sdo.RESPONSE_TIMEOUT = 10
        network.add_node(remote)
        yield remote
    finally:
        network.disconnect()


def as_shown(tpdo):
    """A python-canopen map in the format of `pdo show`."""
    name = {254: "timer", 255: "event", 0: "acyclic"}.get(tpdo.trans_type, f"sync:{tpdo.trans_type}")
    return f"0x{tpdo.cob_id:03X}", tpdo.enabled, tpdo.rtr_allowed, name, [
        (f"0x{entry.index:04X}:{entry.subindex}", entry.length) for entry in tpdo.map]


def shown(pdo):
    return pdo["cob_id"], pdo["valid"], pdo["rtr"], pdo["transmission"], [
        (entry["object"], entry["bits"]) for entry in pdo["mapping"]]


def python_master_maps_simulated_devices(cangauge, directory):
    """node.tpdo.read() and .save() of python-canopen with simulated devices, checked with both programs."""
    kinds = [
        ("mh4", 1, 2, {}, 254, [(0x9130, 1, 32), (0x6150, 2, 8)]),
        ("d20", 2, 1, {}, 254, [(0x6130, 1, 32)]),
        ("mc1609", 3, 4, {}, 255, [(0x7130, 16, 16), (0x7130, 1, 16)]),
        ("dps", 127, 1, {0x6130: od.INTEGER32}, 255, [(0x7100, 1, 16), (0x6130, 1, 32)]),
    ]
    bench = ",".join(f"{kind}@{node}" for kind, node, *_ in kinds)
    with cangauge.simulator(bench, directory):
        for kind, node, count, types, transmission, mapping in kinds:
            # Two SDO clients share one channel: they take turns.
            delivered = settings(cangauge, node)
            with master(cangauge.interface, node, count, types) as remote:
                remote.tpdo.read()
                assert [as_shown(remote.tpdo[n + 1]) for n in range(count)] == [shown(pdo) for pdo in delivered], kind
                # Written back unchanged: this changes nothing.
                remote.tpdo.save()
            assert settings(cangauge, node) == delivered, kind
            with master(cangauge.interface, node, count, types) as remote:
                tpdo = remote.tpdo[1]
                tpdo.read()
                tpdo.clear()
                for index, subindex, bits in mapping:
                    tpdo.add_variable(index, subindex, bits)
                tpdo.trans_type, tpdo.event_timer = transmission, 100
                tpdo.save()
                saved = as_shown(tpdo)
                # The next TPDO has the length of the new mapping.
                remote.nmt.state = "OPERATIONAL"
                assert tpdo.wait_for_reception(GIVE_UP) is not None, kind
                assert len(tpdo.data) == sum(bits for *_, bits in mapping) // 8, (kind, bytes(tpdo.data))
                remote.nmt.state = "PRE-OPERATIONAL"
            pdo = settings(cangauge, node, 1)[0]
            assert shown(pdo) == saved and pdo["event_timer_ms"] == 100, (kind, pdo)
            # cangauge maps, python-canopen reads.
            back = [f"{entry['object']}/{entry['bits']}" for entry in delivered[0]["mapping"]]
            cangauge.run(*PATIENT, "pdo", "map", node, 1, *back)
            with master(cangauge.interface, node, count, types) as remote:
                remote.tpdo[1].read()
                assert as_shown(remote.tpdo[1])[4] == shown(delivered[0])[4], kind


CHECKS = [pdo_show, pdo_map, python_master_maps_simulated_devices]
