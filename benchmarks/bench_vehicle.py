"""The vehicle: differential flatness, simulation and comparison; ``python benchmarks/bench_vehicle.py`` prints a table.

The classes are in the style of asv: ``setup``, then ``time_*``. RotorPy, where it is installed, flies the same vehicle
under the same rotor commands in the same run.
"""

from __future__ import annotations

import math
import platform
import statistics
import timeit
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

import minsnap
from minsnap.flight import CascadeController, GeometricController, compare, simulate, simulate_open_loop
from minsnap.flight.simulation.rotorpy import from_rotorpy, reorder_rotors
from minsnap.vehicle import BodyDrag, Quadrotor, RigidBody, flat_states, specific_thrust, tilt_rate


class Flatness:
    """100,000 instants of a figure of eight."""

    def setup(self) -> None:
        self.vehicle = Quadrotor.dji_f330()
        path = minsnap.lemniscate(laps=10)
        t = np.linspace(0.0, path.duration, 100_000)
        self.motion = [path(t, order) for order in range(1, 5)]

    def time_whole_state_with_drag(self) -> None:
        flat_states(self.vehicle, *self.motion)

    def time_whole_state_without_drag(self) -> None:
        flat_states(self.vehicle, *self.motion, drag=BodyDrag())

    def time_thrust_and_tilt_rate_alone(self) -> None:
        specific_thrust(self.motion[1])
        tilt_rate(self.motion[1], self.motion[2])


class Simulation:
    """120 s of circles at 3 m/s, control at 250 Hz."""

    def setup(self) -> None:
        self.vehicle = Quadrotor.dji_f330()
        self.path = minsnap.circle(radius=3.0, speed=3.0, laps=18)

    def time_geometric_control_120_s(self) -> None:
        simulate(self.vehicle, GeometricController(), self.path, compensation=self.vehicle.drag, duration=120.0)

    def time_cascade_120_s(self) -> None:
        simulate(self.vehicle, CascadeController(), self.path, duration=120.0)

    def time_open_loop_12_s(self) -> None:
        simulate_open_loop(self.vehicle, minsnap.circle(period=6.0, laps=1.75, ramp=math.pi / 4))


class Comparison:
    """A flight of 120 s logged at 50 Hz against setpoints at 20 Hz."""

    def setup(self) -> None:
        path = minsnap.circle(radius=3.0, speed=3.0, laps=18)
        t = np.arange(0.0, 110.0, 0.02)
        self.reference, self.flight = path.sample(20.0), minsnap.Samples(t + 0.1, path(t))

    def time_compare(self) -> None:
        compare(self.reference, self.flight)


class Integrators:
    """2 s under rotor commands that change every 4 ms: the fixed step against adaptive ones restarted at each."""

    def setup(self) -> None:
        self.vehicle, self.step = Quadrotor.dji_f330(), 0.004
        self.body = RigidBody(self.vehicle)
        t = self.step * np.arange(500)[:, None]
        wave = 1 + 0.03 * np.hstack([np.sin(3 * t), -0.6 * np.sin(3 * t), 0.3 * np.sin(5 * t), 0.2 * np.cos(3 * t)])
        self.commands = (self.vehicle.hover_rotor_speed * wave).tolist()
        self.start = [0.0, 0, 0, 1.0, 0.5, 0, 1, 0, 0, 0, 0, 0, 0]

    def time_runge_kutta_fixed_step(self) -> list[float]:
        state = self.start
        for command in self.commands:
            state = self.body.advance(state, (command, command, command), (0.0, 0.0, 0.0), self.step)
        return state

    def _adaptive(self, method: str, tolerance: float) -> list[float]:
        state = self.start
        for command in self.commands:
            rate = lambda t, s, command=command: self.body.derivative(s.tolist(), command)  # noqa: E731
            state = (
                solve_ivp(rate, (0, self.step), state, method=method, rtol=tolerance, atol=tolerance).y[:, -1].tolist()
            )
        return state

    def time_scipy_rk45(self) -> list[float]:
        return self._adaptive("RK45", 1e-9)

    def time_scipy_dop853(self) -> list[float]:
        return self._adaptive("DOP853", 1e-12)


class RotorPy:
    """2 s of the Hummingbird under rotor commands at 500 Hz, in RotorPy and here."""

    def setup(self) -> None:
        from rotorpy.vehicles.hummingbird_params import quad_params
        from rotorpy.vehicles.multirotor import Multirotor

        self.parameters, self.step = quad_params | {"k_h": 0.0}, 0.002
        self.vehicle = from_rotorpy(self.parameters)
        hover = self.vehicle.hover_rotor_speed
        self.state = {
            "x": np.zeros(3),
            "v": np.zeros(3),
            "q": np.array([0.0, 0, 0, 1]),
            "w": np.zeros(3),
            "wind": np.zeros(3),
            "rotor_speeds": np.full(4, hover),
        }
        self.theirs = Multirotor(self.parameters, self.state)
        self.commands = hover * (1 + 0.02 * np.random.default_rng(0).normal(size=(1000, 4)))

    def time_rotorpy(self) -> None:
        state = self.state
        for command in self.commands:
            state = self.theirs.step(state, {"cmd_motor_speeds": command}, self.step)

    def time_here(self) -> None:
        body, speeds = RigidBody(self.vehicle), self.state["rotor_speeds"]
        state = [0.0] * 6 + [1.0] + [0.0] * 6
        half, whole = (math.exp(-part * self.step / self.vehicle.motor_time_constant) for part in (0.5, 1.0))
        for command in reorder_rotors(self.commands):
            stages = (speeds, command + half * (speeds - command), command + whole * (speeds - command))
            state = body.advance(state, stages, (0.0, 0.0, 0.0), self.step)
            speeds = stages[2]


def median_time(work: Callable[[], object], repeats: int = 5) -> float:
    """Return the median wall time of a few runs, after one that does not count [s]."""
    return statistics.median(timeit.repeat(work, repeat=repeats + 1, number=1)[1:])


def main() -> None:
    """Print a Markdown table of every time, and the error of each integrator."""
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}\n")
    print("| work | median |\n|---|---|")
    for group in (Flatness, Simulation, Comparison, Integrators, RotorPy):
        bench = group()
        try:
            bench.setup()
        except ImportError:
            continue
        for name in (name for name in dir(bench) if name.startswith("time_")):
            print(
                f"| {group.__name__}: {name[5:].replace('_', ' ')} | {1e3 * median_time(getattr(bench, name)):.2f} ms |"
            )
    bench = Integrators()
    bench.setup()
    exact = np.array(bench._adaptive("DOP853", 1e-13))
    for name, state in (("fixed step", bench.time_runge_kutta_fixed_step()), ("RK45", bench.time_scipy_rk45())):
        error = np.linalg.norm(np.array(state[:3]) - exact[:3])
        print(f"\n{name}: position is off by {error:.1e} m after 2 s")


if __name__ == "__main__":
    main()
