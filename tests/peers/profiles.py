"""python-canopen devices of CiA 401, 402, 404, 406 and 410, made from EDS files."""

import contextlib
import copy
import os

import canopen

from harness import PATIENT
from keeping import network

EDS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "data", "eds")


class Profile:
    """A device: its EDS, the values that the node holds, and the signals that cangauge shows."""

    def __init__(self, number, eds, values, signals, named, setting):
        self.number, self.eds, self.values = number, os.path.join(EDS, eds), values
        # Without the EDS, and with it in the order of the new mapping: (signal, value, unit).
        self.signals, self.named = signals, named
        # Lines of a settings file that change the device.
        self.setting = setting


PROFILES = [
    Profile(
        410, "33-inclinometer.eds", {(0x6010, 0): -1234, (0x6020, 0): 500, (0x2100, 0): -40},
        [("slope-long16", "-12.34", "deg"), ("slope-lateral16", "5.00", "deg")],
        [("sensor-temperature", "-40", ""), ("slope-long16", "-12.34", "deg")], "[object]\nfilter-time = 250",
    ),
    Profile(
        406, "34-encoder.eds", {(0x6004, 0): 4096, (0x6030, 1): -7},
        [("position-value", "20.480", "mm"), ("speed-value:1", "-0.7", "mm/s")],
        [("speed-value:1", "-0.7", "mm/s"), ("position-value", "20.480", "mm")], "[object]\ncyclic-timer = 20",
    ),
    Profile(
        401, "35-inputs.eds", {(0x6000, 1): 165, (0x6401, 1): -1234, (0x6401, 2): 321},
        [("digital-input-8:1", "165", ""), ("analogue-input-16:1", "-1234", "")],
        [("read-input-8-bit:1", "165", ""), ("read-analogue-input-16-bit:2", "321", "")], '[object]\n"polarity-input-8-bit:1" = 3',
    ),
    Profile(
        402, "36-drive.eds", {(0x6041, 0): 0x0237, (0x6064, 0): -100000, (0x6077, 0): -5},
        [("statusword", "567", ""), ("position-actual-value", "-100000", "")],
        [("position-actual-value", "-100000", ""), ("torque-actual-value", "-5", "")], "[object]\nprofile-velocity = 2500",
    ),
    Profile(
        404, "37-transmitter.eds", {(0x7130, 1): -1500, (0x7130, 2): 215},
        [("ch1", "-1.500", "bar"), ("ch2", "21.5", "degC")],
        [("ch2", "21.5", "degC"), ("ch1", "-1.500", "bar")], "[signal.ch1]\ndigits = 2",
    ),
]


class EdsDevice:
    """A python-canopen device with the object dictionary of an EDS: it sends TPDO 1 on SYNC, and it has non-volatile
    memory."""

    def __init__(self, bus, id, profile):
        self.profile, self.stored = profile, {}
        self.node = bus.add_node(canopen.LocalNode(id, profile.eds))
        self.node.add_write_callback(self.written)
        bus.subscribe(0, self.commanded)
        bus.subscribe(0x80, self.synced)
        self.boot()

    def boot(self):
        self.node.data_store = copy.deepcopy(self.stored)
        for (index, subindex), value in self.profile.values.items():
            self.node.set_data(index, subindex, self.node.object_dictionary.get_variable(index, subindex).encode_raw(value))
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def commanded(self, _, data, __):
        # python-canopen itself only records the reset.
        if data[0] in (129, 130) and data[1] in (0, self.node.id):
            self.boot()

    def written(self, index, subindex, od, data):
        if (index, bytes(data)) == (0x1010, b"save"):
            self.stored = copy.deepcopy(self.node.data_store)
        # The defaults are valid after a reset.
        if (index, bytes(data)) == (0x1011, b"load"):
            self.stored = {}

    def number(self, index, subindex):
        return int.from_bytes(self.node.get_data(index, subindex), "little")

    def mapped(self):
        return [self.number(0x1A00, n) for n in range(1, self.number(0x1A00, 0) + 1)]

    def synced(self, *_):
        cob_id = self.number(0x1800, 1)
        if self.node.nmt.state == "OPERATIONAL" and not cob_id >> 31:
            data = b"".join(self.node.get_data(entry >> 16, entry >> 8 & 0xFF) for entry in self.mapped())
            self.node.network.send_message(cob_id & 0x7FF, data)


@contextlib.contextmanager
def eds_devices(interface):
    """One device of each profile, with node-IDs from 1."""
    with network(interface) as bus:
        found = [EdsDevice(bus, id, profile) for id, profile in enumerate(PROFILES, start=1)]
        yield found
        for device in found:
            device.node.nmt.stop_heartbeat()


def python_devices_of_each_profile(cangauge, directory):
    """Signals by their names, with and without the EDS: values, units and signs are those of the node."""
    def run(*words):
        return cangauge.run(*PATIENT, *words)

    def shows(expected, *options):
        """read, log and check have the values of the nodes."""
        read = run(*options, "read", nodes, "--format", "json").json()
        read = {(one["node"], one["signal"]): (one["value"], one["unit"] or "") for one in read}
        log = run(*options, "log", nodes, "--start", "--sync", "50ms", "--count", 2 * len(expected))
        rows = {(int(row["node"]), row["signal"]): (row["value"], row["unit"]) for row in log.rows()}
        for id, name, value, unit in expected:
            assert read[id, name] == (float(value), unit), (id, name, read)
            assert rows[id, name] == (value, unit), (id, name, log)
        run(*options, "check", nodes, *(f'{id}."{name}" == {value} {unit}' for id, name, value, unit in expected))

    with eds_devices(cangauge.interface) as devices:
        nodes = f"1-{len(devices)}"
        each = [(device.node.id, device.profile) for device in devices]
        scan = run("scan", nodes, "--format", "json").json()
        assert [(one["profile"], one["vendor"], one["serial"]) for one in scan] == [
            (profile.number, 0xABC, 4711) for _, profile in each], scan
        shows([(id, *signal) for id, profile in each for signal in profile.signals])
        files = [word for id, profile in each for word in ("--eds", f"{id}={profile.eds}")]
        for device, (id, profile) in zip(devices, each):
            before = device.mapped()
            run(*files, "pdo", "map", id, 1, *(name for name, *_ in profile.named))
            assert len(device.mapped()) == 2 and device.mapped() != before, (id, device.mapped())
            page = run(*files, "info", id).out
            assert all(f" {name} " in page and value in page for name, value, _ in profile.named), page
        shows([(id, *signal) for id, profile in each for signal in profile.named], *files)


def python_devices_are_configured_from_a_file(cangauge, directory):
    """dump, factory defaults, apply and dump give the same file; python-canopen reads the DCF."""
    file, dcf = (os.path.join(directory, name) for name in ("node.toml", "node.dcf"))

    def write(path, text):
        with open(path, "w", encoding="utf-8") as out:
            out.write(text)

    with eds_devices(cangauge.interface) as devices:
        # CiA 410, 401 and 404: each takes some seconds.
        for device in devices[::2]:
            def config(verb, *words):
                return cangauge.run(*PATIENT, "--eds", device.profile.eds, "config", verb, device.node.id, *words)

            names, setting = [name for name, *_ in device.profile.named], device.profile.setting
            write(file, f'[node]\nheartbeat = "500ms"\n[tpdo.1]\nsignals = {names}\n{setting}\n')
            config("apply", file)
            dump = config("dump").out
            assert all(f"{line}\n" in dump for line in ['heartbeat = "500ms"', *setting.splitlines()]), dump
            write(file, dump)
            write(dcf, config("dump", "--dcf").out)
            entries = [entry for item in canopen.import_od(dcf, device.node.id).values()
                       for entry in (item.values() if hasattr(item, "values") else [item]) if entry.value is not None]
            assert {0x1017, 0x1800, 0x1A00} < {entry.index for entry in entries}, dump
            for entry in entries:
                assert entry.encode_raw(entry.value) == device.node.get_data(entry.index, entry.subindex), entry
            cangauge.run(*PATIENT, "restore", device.node.id, "--reset")
            assert device.number(0x1017, 0) == 0
            config("apply", file, "--store", "--reset")
            assert config("dump").out == dump


CHECKS = [python_devices_of_each_profile, python_devices_are_configured_from_a_file]
