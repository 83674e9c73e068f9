"""Logs of simulated flights in the formats of real ones: what the sensors of a body with known drag measure."""

import struct

import numpy as np
from scipy.spatial.transform import Rotation
from ulog_bytes import fields, ulog

from minsnap.files.frames import map_vectors

NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD = np.diag([1.0, -1.0, -1.0])
BOOT = 5.0


class Measured:
    """A simulated flight as its sensors see it: z-down axes, noise and bias."""

    def __init__(self, vehicle, flight, seed=0, noise=0.05, bias=(0.0, 0.0, 0.0), hover=0.5):
        rng = np.random.default_rng(seed)
        turns = Rotation.from_quat(np.roll(flight.quaternion, -1, axis=1)).as_matrix()
        air = np.einsum("mji,mj->mi", turns, flight.velocity - flight.wind)
        thrust = vehicle.wrench(flight.rotor_speed)[:, 0]
        felt = vehicle.drag.force(air)
        felt[:, 2] += thrust
        felt = felt / vehicle.mass + np.asarray(bias) + noise * rng.normal(size=felt.shape)
        self.stamp = np.round((flight.t + BOOT) * 1e6).astype(int)
        self.position = map_vectors(flight.position, "enu", "ned") + 0.002 * rng.normal(size=(len(flight.t), 3))
        self.velocity = map_vectors(flight.velocity, "enu", "ned") + 0.01 * rng.normal(size=(len(flight.t), 3))
        self.force = felt @ FRD
        self.rotation = NED @ turns @ FRD
        self.throttle = hover * thrust / vehicle.weight
        reference = flight.reference
        self.asked = [map_vectors(values, "enu", "ned") for values in
                      (reference.position, reference.velocity, reference.acceleration)]  # fmt: skip


def ulog_of(measured, every=5):
    """A ULog at 50 Hz (250 Hz for the accelerometer), with the topics that PX4 logs by default."""
    quaternion = np.roll(Rotation.from_matrix(measured.rotation).as_quat(), 1, axis=1)
    slow = slice(None, None, every)

    def rows(*columns, pick=slow):
        table = np.column_stack(columns)[pick]
        return [(stamp, *row) for stamp, row in zip(measured.stamp[pick].tolist(), table.tolist(), strict=True)]

    zeros = np.zeros((len(measured.stamp), 2))
    return ulog([
        ("vehicle_local_position", fields("float", "x y z vx vy vz"), rows(measured.position, measured.velocity)),
        ("vehicle_attitude", "uint64_t timestamp;float[4] q;", rows(quaternion)),
        ("sensor_combined", "uint64_t timestamp;float[3] accelerometer_m_s2;", rows(measured.force, pick=slice(None))),
        ("vehicle_thrust_setpoint", "uint64_t timestamp;float[3] xyz;", rows(zeros, -measured.throttle)),
        ("trajectory_setpoint", "uint64_t timestamp;float[3] position;float[3] velocity;float[3] acceleration;",
         rows(*measured.asked)),
    ])  # fmt: skip


_SIZES = {"Q": 8, "f": 4, "B": 1, "n": 4, "N": 16, "Z": 64}
_CODES = {"Q": "Q", "f": "f", "B": "B", "n": "4s", "N": "16s", "Z": "64s"}
_FMT = (0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
_ATT = (0x93, "ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw")
_XKF = (0x94, "XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD")
_IMU = (0x95, "IMU", "QBfff", "TimeUS,I,AccX,AccY,AccZ")
_CTUN = (0x96, "CTUN", "Qff", "TimeUS,ThO,ThH")


def _record(kind, *values):
    return bytes([0xA3, 0x95, kind[0]]) + struct.pack("<" + "".join(_CODES[code] for code in kind[2]), *values)


def dataflash_of(measured, every=5):
    """A dataflash log with the estimator's states at 50 Hz and two accelerometers, the second of them broken."""
    angles = np.degrees(Rotation.from_matrix(measured.rotation).as_euler("ZYX"))[:, ::-1]
    out = b""
    for kind in (_FMT, _ATT, _XKF, _IMU, _CTUN):
        length = 3 + sum(_SIZES[code] for code in kind[2])
        out += _record(_FMT, kind[0], length, *(part.encode() for part in kind[1:]))
    for k, stamp in enumerate(measured.stamp.tolist()):
        out += _record(_IMU, stamp, 0, *measured.force[k]) + _record(_IMU, stamp, 1, 1.0, 2.0, 3.0)
        if k % every == 0:
            out += _record(_XKF, stamp, 0, *measured.velocity[k], *measured.position[k])
            out += _record(_ATT, stamp, *angles[k]) + _record(_CTUN, stamp, measured.throttle[k], 0.25)
    return out
