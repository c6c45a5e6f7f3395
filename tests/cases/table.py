"""The table of cases: a scene is a device class, and each `@case` above it is a command line with its result."""

SCENES = {}


class Case:
    """A command line of cangauge and its expected result. The patterns are regular expressions."""

    def __init__(self, line, exit_code, out, err, never, rows):
        self.line, self.exit = line, exit_code
        self.out, self.err, self.never = ((it,) if isinstance(it, str) else it for it in (out, err, never))
        self.rows = rows


def case(line, exit_code=0, *, out=(), err=(), never=(), rows=None):
    """Adds a command line to the scene below.

    `out` and `err` must be found on standard output and standard error, `never` on neither. `rows` is the number of
    lines on standard output after the header. `{node}` is the node-ID of the device, `{dir}` an empty directory.
    """

    def add(device):
        device.cases = [Case(line, exit_code, out, err, never, rows), *device.__dict__.get("cases", [])]
        SCENES[device.__name__] = device
        return device

    return add
