"""A valid file of every kind that is read, and bytes near it."""

import struct
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from bag_files import mcap_bag, sqlite_bag
from flown_logs import dataflash_of
from octree_files import octree_file, put
from ulog_bytes import fields, ulog

import minsnap
from minsnap.errors import CorridorError, FileError, VehicleError
from minsnap.files.convert import write_any
from minsnap.vehicle import Quadrotor, write_vehicle


def seeds(folder):
    """Return small valid files by name, as bytes."""
    path = minsnap.plan([(0, 0, 1), (2, 0, 1), (2, 1, 1)], [2.0, 1.5], yaw=[0.0, 0.5, 0.0])
    names = {"path.csv": "setpoints", "piece.csv": "crazyflie", "path.yaml": "mav", "path.npz": "npz"}
    names |= {
        "path.json": "polynomials",
        "path.yml": "polynomials",
        "path.traj": "crazyflie-compressed",
        "path.skyb": "skybrush",
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", minsnap.errors.FirmwareWarning)
        for name, to in names.items():
            write_any(path, folder / name, to, rate=4.0)
    for name, to in MISSIONS.items():
        write_any(path, folder / name, to, origin=(47.3977, 8.5456, 488.0))
    write_any(path.sample(4.0), folder / "path.parquet", "parquet")
    write_any(path.sample(4.0), folder / "samples.npz", "npz")
    (folder / "points.csv").write_text("x,y,z,yaw,duration\n0,0,1,0,2\n2,0,1,0.5,1.5\n2,1,1,0,\n")
    (folder / "points.yaml").write_text("waypoints:\n- [0, 0, 1]\n- {x: 2, y: 0, z: 1}\ndurations: [2.0]\n")
    write_vehicle(Quadrotor.crazyflie(), folder / "vehicle.yaml")
    mcap_bag(folder / "log.mcap", "/mavros/local_position/pose")
    sqlite_bag(folder / "log.db3", ["/mavros/local_position/pose"])
    (folder / "log.ulg").write_bytes(_ulog())
    (folder / "log.bin").write_bytes(_dataflash())
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    for name, content in {**_clouds(), **_octrees(), "map.pgm": PICTURE}.items():
        (folder / name).write_bytes(content)
    np.save(folder / "array.npy", np.eye(4, dtype=np.int8) * 100)
    np.save(folder / "points.npy", np.array([[0.0, 0.0, 0.5], [1.0, -2.0, 3.25]]))
    np.savez(folder / "obstacles.npz", occupancy=np.ones((2, 2, 2), bool), resolution=0.5, origin=np.zeros(3))
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def _ulog():
    rows = [(5_000_000 + 20_000 * k, 0.1 * k, 0, -1.5, 5, 0, 0, 0, 0, 0, 0.1) for k in range(8)]
    return ulog([("vehicle_local_position", fields("float", "x y z vx vy vz ax ay az heading"), rows)])


def _dataflash():
    count = 12
    still = {"rotation": np.tile(np.eye(3), (count, 1, 1)), "throttle": np.full(count, 0.4)}
    moved = {name: np.zeros((count, 3)) for name in ("force", "velocity", "position")}
    return dataflash_of(SimpleNamespace(stamp=np.arange(count) * 4000, **still, **moved))


def _clouds():
    points = struct.pack("<6f", 0.0, 0.0, 0.5, 1.0, -2.0, 3.25)
    heads = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n"
    literal = bytes([len(points) - 1]) + points
    squeezed = struct.pack("<II", len(literal), len(points)) + literal
    pcds = {"text": b"0 0 0.5\n1 -2 3.25\n", "binary": points, "squeezed": squeezed}
    kinds = {"text": "ascii", "binary": "binary", "squeezed": "binary_compressed"}
    found = {f"{n}.pcd": f"VERSION .7\n{heads}DATA {kinds[n]}\n".encode() + body for n, body in pcds.items()}
    for name, kind, body in (("text", "ascii", pcds["text"]), ("binary", "binary_little_endian", points)):
        sides = "".join(f"property float {axis}\n" for axis in "xyz")
        found[f"{name}.ply"] = f"ply\nformat {kind} 1.0\nelement vertex 2\n{sides}end_header\n".encode() + body
    return found | {"cloud.xyz": pcds["text"], "cloud.csv": b"x,y,z\n0,0,0.5\n1,-2,3.25\n"}


def _octrees():
    tree = {}
    for number in range(12):
        put(tree, (32766 + number % 3, 32767, 32768 - number), 16, 0.85 - number)
    put(tree, (32770, 32768, 32768), 15, -2.0)
    return {"tree.bt": octree_file(tree, True), "tree.ot": octree_file(tree, False)}


MISSIONS = {
    "mission.plan": "qgroundcontrol",
    "mission.waypoints": "ardupilot",
    "mission.kml": "kml",
    "mission.kmz": "dji",
    "litchi.csv": "litchi",
}
"""Missions by latitude and longitude, and the formats that write them."""

PICTURE = b"P5\n# map\n4 3\n255\n" + bytes([0, 254, 205, 254, 254, 254, 254, 0, 254, 100, 254, 254])

TEXTS = {
    "route.gpx": '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><name>a</name><trkseg>'
    '<trkpt lat="47.398" lon="8.5456"><ele>500</ele><time>2026-11-30T05:00:00Z</time></trkpt></trkseg><trkseg>'
    '<trkpt lat="47.3981" lon="8.546"><ele>510.5</ele></trkpt></trkseg></trk></gpx>',
    "ground.asc": "ncols 3\nnrows 2\nxllcorner -5\nyllcorner 0.5\ncellsize 10\nNODATA_value -9999\n1 2 3\n4 5 -9999\n",
    "map.yaml": "image: map.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
    "free_thresh: 0.196\n",
    "course.yaml": "name: yard\nwaypoints:\n- [0, 0, 1.5]\n"
    "- {center: [5, 0, 1.5], heading_deg: 0, width: 1, height: 0.8}\n"
    "- {x: 8, y: 3, z: 2, ball: 0.4}\n- [0, 0, 1.5]\nclosed: true\nlaps: 2\nlimits: {speed: 4, acceleration: 6}\n",
    "batch.yaml": "generator: walks\ncount: 10\nseed: 3\nlegs: [2, 4]\nlimits: {speed: [2, 3]}\ncorridor: 0.3\n",
    "request.yaml": "waypoints:\n- [0, 0, 1]\n- [2, 0, 1]\nlimits: {speed: 2}\ncorridor: 0.3\n"
    "room: [[-1, -1, 0], [4, 4, 4]]\n",
}
"""Files that are text: what stands in them, by name."""


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
    from minsnap.batch.spec import read_spec
    from minsnap.files.convert import read_any
    from minsnap.files.request_yaml import read_request
    from minsnap.paths.routes import read_terrain
    from minsnap.studio.ground_view import read_obstacles
    from minsnap.vehicle import read_vehicle

    by_reader = {
        read_any: "path.csv piece.csv path.yaml path.npz samples.npz path.json path.yml path.traj path.skyb "
        "path.parquet log.ulg log.bin log.mcap log.db3",
        minsnap.read_waypoints: " ".join(("points.csv", "points.yaml", "route.gpx", *MISSIONS)),
        read_vehicle: "vehicle.yaml",
        minsnap.read_course: "course.yaml",
        read_spec: "batch.yaml",
        read_request: "request.yaml",
        read_obstacles: "obstacles.npz",
        _read_cells: "array.npy text.pcd binary.pcd squeezed.pcd text.ply binary.ply cloud.xyz cloud.csv points.npy",
        minsnap.routes.read_map: "tree.bt tree.ot",
        read_terrain: "ground.asc",
        _read_map_server: "map.yaml",
        _read_picture: "map.pgm",
    }
    return {name: read for read, names in by_reader.items() for name in names.split()}


def refusals():
    """Exceptions that a reader may end with: a vehicle or a map may also be wrong as a whole."""
    return FileError, VehicleError, CorridorError


def _read_cells(path):
    return minsnap.routes.read_map(path, resolution=0.5)


def _read_map_server(path):
    Path(path).with_name("map.pgm").write_bytes(PICTURE)
    return minsnap.routes.read_map(path)


def _read_picture(path):
    described = Path(path).with_name("map.yaml")
    described.write_text(TEXTS["map.yaml"])
    return minsnap.routes.read_map(described)
