"""Object dictionaries for python-canopen, written in code. They share no EDS file with cangauge."""

from canopen import objectdictionary as od

# Name, index and type of the objects of CiA 404 (analogue inputs) that the peers use.
ANALOGUE_INPUT = [
    ("AI sensor type", 0x6110, od.UNSIGNED16),
    ("AI input PV REAL32", 0x6130, od.REAL32),
    ("AI physical unit", 0x6131, od.UNSIGNED32),
    ("AI decimal digits", 0x6132, od.UNSIGNED8),
    ("AI status", 0x6150, od.UNSIGNED8),
    ("AI input PV INTEGER16", 0x7130, od.INTEGER16),
    ("AI input PV INTEGER32", 0x9130, od.INTEGER32),
]


def variable(name, index, subindex, data_type, default=None, access="rw"):
    """One object or sub-object."""
    entry = od.ODVariable(name, index, subindex)
    entry.data_type = data_type
    entry.access_type = access
    entry.default = default
    entry.pdo_mappable = True
    return entry


def record(name, index, members):
    """An object with exactly the given sub-indices: (sub-index, type, default, access)."""
    entry = od.ODRecord(name, index)
    for subindex, data_type, default, access in members:
        entry.add_member(variable(f"{name} {subindex}", index, subindex, data_type, default, access))
    return entry


def channels(name, index, data_type, values, access="ro"):
    """An object with one sub-index for each channel, and their number in sub-index 0."""
    members = [(0, od.UNSIGNED8, len(values), "const")]
    members += [(n, data_type, value, access) for n, value in enumerate(values, start=1)]
    return record(name, index, members)


def array(name, index, data_type):
    """An object of a remote device, with the same number of sub-indices."""
    entry = od.ODArray(name, index)
    entry.add_member(variable(f"{name} count", index, 0, od.UNSIGNED8))
    entry.add_member(variable(f"{name} 1", index, 1, data_type))
    return entry


def communication(number):
    """The communication and mapping parameters of a remote device's TPDO, counted from 1."""
    members = [(0, od.UNSIGNED8), (1, od.UNSIGNED32), (2, od.UNSIGNED8), (3, od.UNSIGNED16), (5, od.UNSIGNED16)]
    yield record(f"TPDO {number} parameters", 0x1800 + number - 1, [(sub, kind, None, "rw") for sub, kind in members])
    yield array(f"TPDO {number} mapping", 0x1A00 + number - 1, od.UNSIGNED32)


def mapping(number):
    """The mapping parameters with each sub-index listed, as in an EDS file. python-canopen writes an array only up to
    its present number of entries, which is 0 during a change."""
    entries = [(sub, od.UNSIGNED32 if sub else od.UNSIGNED8, None, "rw") for sub in range(9)]
    return record(f"TPDO {number} mapping", 0x1A00 + number - 1, entries)


def remote_device(types):
    """The object dictionary that a master uses for any measuring device with up to four TPDOs. `types` lists the
    CiA 404 objects with a different type on this device."""
    dictionary = od.ObjectDictionary()
    objects = [
        variable("Device type", 0x1000, 0, od.UNSIGNED32),
        variable("Error register", 0x1001, 0, od.UNSIGNED8),
        variable("Device name", 0x1008, 0, od.VISIBLE_STRING),
        variable("Producer heartbeat time", 0x1017, 0, od.UNSIGNED16),
        array("Identity", 0x1018, od.UNSIGNED32),
        # A manufacturer-specific process value, as one of the built-in devices maps it.
        variable("Process value", 0x2090, 0, od.INTEGER32),
    ]
    objects += [array(name, index, types.get(index, kind)) for name, index, kind in ANALOGUE_INPUT]
    for number in range(1, 5):
        objects += communication(number)
    for entry in objects:
        dictionary.add_object(entry)
    return dictionary
