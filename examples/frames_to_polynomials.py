"""An animation of 30 s at 24 frames a second, in whole millimetres, as few polynomials as a Crazyflie holds.

Frames of Blender, motion capture, samples of another planner: positions at instants, rounded or noisy. Through every
one of them goes no curve that can be flown; within a tolerance of them goes one of a dozen polynomials. On the command
line:

    minsnap convert frames.csv dance.traj --tolerance 5mm
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.files.convert import write_any
from minsnap.plot import plot_overview, save_figure


def frames_of_an_animation() -> tuple[np.ndarray, np.ndarray]:
    """Return instants and positions of a figure that grows and shrinks again, rounded as files of keyframes are."""
    t = np.arange(0.0, 30.0 + 1e-9, 1.0 / 24.0)
    size = np.sin(np.pi * t / t[-1]) ** 4
    phase = 2.0 * np.pi * t / 7.5
    place = np.column_stack([1.5 * np.sin(phase), np.sin(2.0 * phase), 0.3 * np.sin(phase)])
    return t, (place * size[:, None] + (0.0, 0.0, 1.0)).round(3)


def main(folder: Path) -> None:
    """Fit the frames, print what is proved, and write the file of the Crazyflie and a figure."""
    folder.mkdir(parents=True, exist_ok=True)
    t, frames = frames_of_an_animation()
    np.savetxt(
        folder / "frames.csv",
        np.column_stack([t, frames]),
        "%.3f",
        ",",
        header="Time [s],x [m],y [m],z [m]",
        comments="",
    )
    for tolerance in (0.002, 0.005, 0.02):
        print(f"{1e3 * tolerance:g} mm: {minsnap.fit_samples(t, frames, tolerance).sentence}")
    fit = minsnap.fit_samples(t, frames, 0.005)
    print(write_any(fit.trajectory, folder / "dance.traj")[1])
    figure = plot_overview(fit.trajectory, waypoints=frames[::6], title="721 frames, few polynomials")
    save_figure(figure, folder / "frames_to_polynomials.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
