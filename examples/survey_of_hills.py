"""A survey that follows the ground: 40 m above hills, 4 m more or less, at every instant.

Lines are straight as seen from above and at exactly 8 m/s over the ground; that they keep their height is proved. On
the command line:

    minsnap survey field.csv --spacing 20 --height 40 --speed 8 --terrain dem.asc --follow 4 -o hills.csv
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import minsnap
from minsnap.plot import save_figure
from minsnap.routes import read_terrain

FIELD = [(0, 0), (160, 0), (180, 90), (20, 110)]
SIDE = 5.0
WITHIN = 4.0


def write_hills(file: Path) -> None:
    """Write two hills as an ESRI ASCII grid, from north to south."""
    x, y = np.meshgrid(np.arange(-100.0, 281.0, SIDE), np.arange(210.0, -101.0, -SIDE))
    ground = sum(h * np.exp(-((x - a) ** 2 + (y - b) ** 2) / 4000) for a, b, h in ((50, 40, 14), (140, 70, 10)))
    head = {"ncols": x.shape[1], "nrows": x.shape[0], "xllcenter": -100, "yllcenter": y.min(), "cellsize": SIDE}
    rows = [f"{name} {value:g}" for name, value in head.items()] + [" ".join(f"{h:.3f}" for h in row) for row in ground]
    file.write_text("\n".join(rows) + "\n")


def main(folder: Path) -> None:
    """Plan it, check its height at many instants, and draw it beside the ground."""
    folder.mkdir(parents=True, exist_ok=True)
    write_hills(folder / "dem.asc")
    terrain = read_terrain(folder / "dem.asc")
    found = minsnap.plan_survey(FIELD, spacing=20, height=40, speed=8, terrain=terrain, within=WITHIN)
    t = np.linspace(0.0, found.duration, 4001)
    place = found(t)
    above = place[:, 2] - terrain.at(place[:, :2])
    on_lines = np.any([(t >= start) & (t <= end) for start, end in found.spans], axis=0)
    assert np.abs(above[on_lines] - 40.0).max() <= WITHIN
    over_ground = np.linalg.norm(found(t, 1)[on_lines, :2], axis=1)
    print(f"{len(found.lines)} lines, {above[on_lines].min():.1f} to {above[on_lines].max():.1f} m above the ground")
    print(f"speed over the ground {over_ground.min():.3f} to {over_ground.max():.3f} m/s")
    minsnap.write_csv(found.trajectory, folder / "hills.csv")

    figure, (plane, height) = plt.subplots(1, 2, figsize=(10.0, 4.0), layout="constrained", width_ratios=(1.0, 1.3))
    x, y = (np.linspace(place[:, axis].min() - 10, place[:, axis].max() + 10, 120) for axis in (0, 1))
    ground = terrain.at(np.stack(np.meshgrid(x, y), axis=-1))
    hills = plane.contourf(x, y, ground, 12, cmap="Greens", alpha=0.7)
    figure.colorbar(hills, ax=plane, label="ground [m]", shrink=0.8)
    plane.plot(*np.array([*FIELD, FIELD[0]]).T, "--", color="#555555", label="field")
    plane.plot(*place[:, :2].T, color="#0072b2", label="flight")
    plane.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="from above")
    plane.legend(loc="upper center", bbox_to_anchor=(0.5, -0.3), ncols=2, fontsize=8)
    height.fill_between(t, 40 - WITHIN, 40 + WITHIN, color="#0072b2", alpha=0.15, label=f"40 m ± {WITHIN:g} m")
    height.plot(t, above, color="#999999", linewidth=1.0, label="turns, above the ground")
    height.plot(t, np.where(on_lines, above, np.nan), color="#0072b2", label="lines, above the ground")
    height.plot(t, place[:, 2], ":", color="#d55e00", label="z")
    height.set(xlabel="time [s]", ylabel="height [m]", ylim=(34.0, 68.0), title="height")
    height.legend(fontsize=8, ncols=2, loc="upper center")
    save_figure(figure, folder / "survey_of_hills.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
