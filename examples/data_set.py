"""A data set of plans: a thousand random flights planned in one call, with those that have no plan left out.

``plan_many`` plans over threads; each problem that cannot be solved has its error beside it. Ctrl-C raises
KeyboardInterrupt here as anywhere, so that no half-finished plan gets into the data.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled

COUNT, LEGS = 1000, 5


@styled
def main(folder: Path) -> None:
    """Plan, keep what worked, write one archive, draw a few."""
    folder.mkdir(parents=True, exist_ok=True)
    draw = np.random.default_rng(0)
    points = np.cumsum(draw.normal(scale=(1.5, 1.5, 0.3), size=(COUNT, LEGS + 1, 3)), axis=1)
    durations = np.linalg.norm(np.diff(points, axis=1), axis=2) / draw.uniform(0.5, 2.0, (COUNT, 1))
    durations[7, 0] = -1.0
    plans = minsnap.plan_many(points, durations=durations)
    kept = [index for index, error in enumerate(plans.errors) if error is None]
    print(f"{len(kept)} of {COUNT} planned; number 7: {plans.errors[7]}")
    control_points = np.stack([plans[index].control_points for index in kept])
    np.savez_compressed(folder / "data_set.npz", control_points=control_points, durations=durations[kept])
    figure = Figure(figsize=(7, 5), layout="constrained")
    ax = figure.add_subplot(xlabel="x [m]", ylabel="y [m]", title=f"12 of {len(kept)} flights", aspect="equal")
    for index in kept[:12]:
        path = plans[index]
        ax.plot(*path(np.linspace(0.0, path.duration, 300))[:, :2].T, linewidth=1.0)
    save_figure(figure, folder / "data_set.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
