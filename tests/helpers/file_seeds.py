"""A valid file of every kind that is read, and bytes near it."""

from ulog_bytes import fields, ulog

import minsnap
from minsnap.files.convert import write_any
from minsnap.vehicle import Quadrotor, write_vehicle


def seeds(folder):
    """Return small valid files by name, as bytes."""
    path = minsnap.plan([(0, 0, 1), (2, 0, 1), (2, 1, 1)], [2.0, 1.5], yaw=[0.0, 0.5, 0.0])
    names = {"path.csv": "setpoints", "piece.csv": "crazyflie", "path.yaml": "mav", "path.npz": "npz"}
    for name, to in names.items():
        write_any(path, folder / name, to, rate=4.0)
    write_any(path.sample(4.0), folder / "samples.npz", "npz")
    (folder / "points.csv").write_text("x,y,z,yaw,duration\n0,0,1,0,2\n2,0,1,0.5,1.5\n2,1,1,0,\n")
    (folder / "points.yaml").write_text("waypoints:\n- [0, 0, 1]\n- {x: 2, y: 0, z: 1}\ndurations: [2.0]\n")
    write_vehicle(Quadrotor.crazyflie(), folder / "vehicle.yaml")
    (folder / "log.ulg").write_bytes(_ulog())
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def _ulog():
    rows = [(5_000_000 + 20_000 * k, 0.1 * k, 0, -1.5, 5, 0, 0, 0, 0, 0, 0.1) for k in range(8)]
    return ulog([("vehicle_local_position", fields("float", "x y z vx vy vz ax ay az heading"), rows)])


def mutated(seed, random):
    """Return a seed with a few edits: bytes changed, cut out, put in, repeated, or swapped for hostile text."""
    content = bytearray(seed)
    for _ in range(1 + int(random.integers(4))):
        place, length = int(random.integers(len(content) + 1)), 1 + int(random.geometric(0.2))
        kind = int(random.integers(6))
        if kind == 0 and place < len(content):
            content[place] ^= 1 << int(random.integers(8))
        elif kind == 1:
            del content[place : place + length]
        elif kind == 2:
            content[place:place] = random.bytes(length)
        elif kind == 3:
            content[place:place] = content[place : place + 10 * length]
        elif kind == 4:
            content[place : place + length] = HOSTILE[int(random.integers(len(HOSTILE)))]
        else:
            del content[place:]
    return bytes(content)


HOSTILE = (
    b"nan", b"-inf", b"1e999", b"9" * 400, b"-", b"[" * 60, b"{", b"&a ", b"*a", b"!!python/none ", b"\x00",
    b"\xff\xfe", b",,", b"\n\n", b": ", b"- ", b"1_000", b"0x1p3", b"1:30", b"(10**9,)",
    b"\x7f\xff\xff\xff", b"1e-320", b"# ",
)  # fmt: skip


def readers():
    """Return what reads each kind of file, by the name of its seed."""
    from minsnap.files.convert import read_any
    from minsnap.vehicle import read_vehicle

    names = ("path.csv", "piece.csv", "path.yaml", "path.npz", "samples.npz", "log.ulg")
    points = dict.fromkeys(("points.csv", "points.yaml"), minsnap.read_waypoints)
    return {**dict.fromkeys(names, read_any), **points, "vehicle.yaml": read_vehicle}
