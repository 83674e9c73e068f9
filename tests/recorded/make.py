"""Record the flights of this folder: ``python tests/recorded/make.py``.

The library's own simulation of PX4's simulated vehicle flies them, with PX4's cascade of controllers, setpoints at 20
Hz and 0.1 s of transport. Logs hold positions and setpoints ten times a second; what was really missed, at every step
of the simulation, is in ``truth.json``. They are kept, since plans and simulation may change, and logs of the past must
not.
"""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

import minsnap
from minsnap.files.autopilot_logs import write_ulog
from minsnap.files.convert import write_any
from minsnap.files.flight_log import FlightLog
from minsnap.files.frames import map_vectors
from minsnap.flight import CascadeController, simulate
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

HERE, WAIT, RATE = Path(__file__).parent, 3.0, 20.0
CORNERS = [(0, 0, 2), (6, 0, 2), (6, 4, 2.5), (0, 4, 2), (0, 0, 2)]


def flights():
    """Name, plan, how much earlier its setpoints are sent [s], and after which share of it a rule stops it."""
    rectangle = minsnap.plan(CORNERS, corridor=0.3, total_time=14.0)
    stops = tuple(minsnap.Stop(point) for point in ((0, 0, 1.5), (5, 0, 2.0), (5, 4, 2.0), (0, 4, 1.5)))
    limits = minsnap.Limits(speed=3.0, acceleration=4.0)
    course = minsnap.Course(stops, closed=True, laps=2, takeoff=True, land=True, limits=limits)
    return [
        ("led", rectangle, 0.2, None),
        ("stopped", rectangle, 0.0, 0.6),
        ("mission", minsnap.plan_mission(course).trajectory, 0.15, None),
    ]


def with_holds(plan, stopped=None, place=None):
    """Setpoints at rest, those of the plan, and at rest again; stopped, from an instant on at a place."""
    t = np.arange(round((plan.duration + 2 * WAIT) * RATE) + 1) / RATE
    inside = np.clip(t - WAIT, 0.0, plan.duration)
    rests = (t < WAIT) | (t > WAIT + plan.duration)
    motion = [np.where(rests[:, None], 0.0, plan(inside, order)) for order in (1, 2)]
    position = plan(inside)
    if stopped is not None:
        gone = t > WAIT + stopped
        position[gone] = place
        for each in motion:
            each[gone] = 0.0
    return Samples(t, position, *motion, yaw=np.zeros_like(t), yaw_rate=np.zeros_like(t))


def record(name, plan, lead, share):
    """Fly, and write plan, logs and what was missed."""
    sent = with_holds(plan)
    fly = lambda wanted: simulate(Quadrotor.px4_sih(), CascadeController(), wanted, setpoint_delay=0.1)  # noqa: E731
    flight, end = fly(sent), plan.duration
    if share is not None:
        end = share * plan.duration
        place = flight.position[np.searchsorted(flight.t, WAIT + end)]
        sent = with_holds(plan, end, place)
        flight = fly(sent)
    every = slice(None, None, round(0.1 / (flight.t[1] - flight.t[0])))
    flown = Samples(flight.t[every], flight.position[every], flight.velocity[every])
    asked = Samples(
        *(None if each is None else each[::2] for each in (sent.t, sent.position, sent.velocity, sent.acceleration))
    )
    write_any(plan, HERE / f"{name}.json")
    write_ulog(FlightLog(asked, flown, 0.0), HERE / f"{name}.ulg")
    (HERE / f"{name}.bin").write_bytes(dataflash(asked, flown))
    t = flight.t - WAIT - lead
    kept = (t >= 0.0) & (t <= end - lead * (share is not None))
    away = np.linalg.norm(flight.position[kept] - plan(np.clip(t[kept], 0.0, plan.duration)), axis=1)
    return {"lead": lead, "followed": end, "rmse": float(np.sqrt(np.mean(away**2))), "greatest": float(away.max())}


def dataflash(asked, flown):
    """Targets and positions as ArduPilot's position controller logs them."""
    own = replace(asked, position=map_vectors(asked.position, "enu", "ned"))
    targets, speeds = own.position, map_vectors(asked.velocity, "enu", "ned")
    places = map_vectors(
        np.stack([np.interp(asked.t, flown.t, column) for column in flown.position.T], axis=1), "enu", "ned"
    )
    moves = map_vectors(
        np.stack([np.interp(asked.t, flown.t, column) for column in flown.velocity.T], axis=1), "enu", "ned"
    )
    fmt = (0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    kinds = [
        (0x90 + k, f"PSC{axis}", "Qffff", f"TimeUS,TP{axis},P{axis},TV{axis},V{axis}") for k, axis in enumerate("NED")
    ]
    sizes = {"Q": 8, "f": 4, "B": 1, "n": 4, "N": 16, "Z": 64}
    codes = {"Q": "Q", "f": "f", "B": "B", "n": "4s", "N": "16s", "Z": "64s"}

    def row(kind, *values):
        return bytes([0xA3, 0x95, kind[0]]) + struct.pack("<" + "".join(codes[c] for c in kind[2]), *values)

    out = b"".join(
        row(fmt, kind[0], 3 + sum(sizes[c] for c in kind[2]), *(part.encode() for part in kind[1:]))
        for kind in (fmt, *kinds)
    )
    for k, t in enumerate(asked.t):
        stamp = round((t + 7.0) * 1e6)
        out += b"".join(
            row(kind, stamp, targets[k, a], places[k, a], speeds[k, a], moves[k, a]) for a, kind in enumerate(kinds)
        )
    return out


if __name__ == "__main__":
    truth = {name: record(name, *how) for name, *how in flights()}
    (HERE / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")
