"""What a rectangle asks of the rotors: thrust, tilt and rotor speeds by differential flatness, checked open loop.

Rotor speeds follow from the trajectory in closed form, drag included. Fed to the equations of motion with no feedback
at all they fly the rectangle to within nanometres, which shows that both are right. Where the corridor holds the curve,
snap jumps at the corners, and with it torques: the small steps in rotor speed at 4, 6 and 10 s.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.flight import simulate_open_loop
from minsnap.plot import save_figure, styled
from minsnap.vehicle import RPM, Quadrotor, check_rotor_limits, flatness_of, tilt


@styled
def main(folder: Path) -> None:
    """Draw thrust, tilt and rotor speeds, and say how far the open loop strays."""
    vehicle = Quadrotor.dji_f330()
    path = minsnap.rectangle(8.0, 4.0, corridor=0.3, durations=[4.0, 2.0, 4.0, 2.0])
    t = np.linspace(0.0, path.duration, 2001)
    states = flatness_of(vehicle, path, t)
    check_rotor_limits(vehicle, states, t)
    strays = np.abs(simulate_open_loop(vehicle, path).error).max()
    figure = Figure(figsize=(8.0, 6.5), layout="constrained")
    thrust, angle, rotors = figure.subplots(3, 1, sharex=True)
    thrust.plot(t, states.thrust / vehicle.weight)
    angle.plot(t, np.degrees(tilt(path(t, 2))))
    for index, style in enumerate(("-", "--", "-.", ":")):
        rotors.plot(t, states.rotor_speed[:, index] / RPM, style, label=f"rotor {index + 1}")
    thrust.set(ylabel="thrust / weight")
    angle.set(ylabel="tilt [°]")
    rotors.set(ylabel="rotor speed [RPM]", xlabel="time [s]")
    rotors.legend(frameon=False, ncols=4)
    figure.suptitle(f"flown open loop for {path.duration:g} s it strays by {1e9 * strays:.1f} nm")
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "rotors_of_a_rectangle.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
