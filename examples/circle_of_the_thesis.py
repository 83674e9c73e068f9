"""Ten circles as the thesis flew them, in simulation: what its tables show, and where they come from.

Hover, trigger, ten laps of 120 setpoints at 20 Hz that start at full speed, PX4's cascade on position and velocity, a
pose at 50 Hz. With no acceleration to follow, the cascade lags and swings wide by more than a metre, whatever
drag does: that, not drag, is what the uncompensated errors of the thesis are made of.
"""

import sys
from pathlib import Path

from minsnap.flight.thesis.experiment import experiment_text, plot_experiment, run_experiment
from minsnap.plot import save_figure


def main(folder: Path) -> None:
    """Fly without compensation, with the published fit, with the consistent one; print the table, draw the figure."""
    experiment = run_experiment("circle", 10)
    print(experiment_text(experiment))
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(plot_experiment(experiment), folder / "circle_of_the_thesis.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
