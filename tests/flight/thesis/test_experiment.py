from dataclasses import replace

import numpy as np
import pytest

from minsnap.errors import InputError, ThrustError, VehicleError
from minsnap.flight import CascadeController, GeometricController, Sensors
from minsnap.flight.thesis.experiment import (
    PUBLISHED_RMSE,
    course,
    drag_model,
    experiment_dict,
    experiment_text,
    plot_experiment,
    run_experiment,
)
from minsnap.vehicle import BodyDrag, Quadrotor


@pytest.mark.parametrize("name", ["circle", "line", "rect"])
@pytest.mark.parametrize("literal", [True, False])
def test_a_course_is_hover_repetitions_and_hold_at_20_hz(name, literal) -> None:
    flown = course(name, 3, literal=literal)
    samples = flown.samples
    np.testing.assert_allclose(np.diff(samples.t), 0.05)
    before, after = samples.t < flown.start - 0.01, samples.t > flown.end + 0.01
    assert not samples.velocity[before].any() and not samples.velocity[after].any()
    np.testing.assert_array_equal(samples.position[before], samples.position[:1].repeat(before.sum(), axis=0))
    assert flown.start == 5.0 and flown.start < flown.settled <= flown.slowing <= flown.end


def test_the_literal_circle_is_120_steps_a_lap_and_starts_at_speed() -> None:
    flown = course("circle", 10)
    assert flown.end - flown.start == pytest.approx(60.0)
    first = flown.samples.position[100:220]
    angle = np.arctan2(first[:, 1], first[:, 0])
    np.testing.assert_allclose(np.diff(np.unwrap(angle)), np.radians(3.0))
    assert np.linalg.norm(flown.samples.velocity[100]) == pytest.approx(np.pi)


def test_the_literal_line_jumps_back_and_the_smooth_one_turns() -> None:
    literal, smooth = course("line", 4), course("line", 4, literal=False)
    assert np.abs(np.diff(literal.samples.position[:, 0])).max() == pytest.approx(7.0)
    assert np.abs(np.diff(smooth.samples.position[:, 0])).max() < 0.2
    assert set(literal.samples.position[:, 1]) == {1.0}
    assert literal.samples.velocity[150, 0] < 1.2, "at most 1.2 m/s in the text"


def test_the_smooth_circle_ends_at_rest_where_it_started() -> None:
    flown = course("circle", 2, literal=False)
    moving = (flown.samples.t >= flown.start) & (flown.samples.t <= flown.end)
    steps = np.diff(flown.samples.velocity[moving], axis=0)
    assert np.abs(steps).max() < 0.3
    np.testing.assert_allclose(flown.samples.position[-1], flown.samples.position[0], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "repeat", "says"), [("star", 1, "'star'.*circle"), ("circle", 0, "from 1"), ("line", 1.5, "1.5")]
)
def test_courses_that_there_are_not_are_named(name, repeat, says) -> None:
    with pytest.raises(InputError, match=says):
        course(name, repeat)


@pytest.fixture(scope="module")
def circles():
    return run_experiment(
        "circle",
        3,
        compensations=(None, "published", "consistent", "exact"),
        controller=GeometricController(),
        literal=False,
    )


@pytest.mark.slow
def test_the_exact_model_helps_most_and_the_published_one_harms(circles) -> None:
    error = {run.compensation: run.steady.rmse_3d for run in circles.runs}
    assert error["exact"] < 0.5 * error[None]
    assert error["exact"] < error["consistent"] < error[None] < error["published"]


def test_transient_and_steady_state_are_parts_of_the_whole(circles) -> None:
    run = circles.run(None)
    flown = circles.course
    assert run.transient.t[-1] <= flown.settled <= run.steady.t[0] and run.steady.t[-1] <= flown.slowing
    assert run.whole.t[0] >= flown.start and run.whole.t[-1] <= flown.end
    with pytest.raises(InputError, match="'full'"):
        circles.run("full")


def test_the_table_has_the_layout_of_the_thesis(circles) -> None:
    lines = experiment_text(circles).splitlines()
    assert lines[0] == "Root mean squared error in tracking of 3 circular trajectories [m]"
    assert lines[1].split("  ")[0] == "axis" and lines[1].count("difference") == 3
    assert [line[0] for line in lines[2:5]] == ["X", "Y", "Z"]
    x = lines[2].split()
    without, published = circles.run(None).whole.rmse[0], circles.run("published").whole.rmse[0]
    assert x[1:4] == [f"{without:.4f}", f"{published:.4f}", f"{without - published:+.4f}"]
    assert "1.0801 → 0.5990" in lines[-1]
    figures = experiment_dict(circles)
    assert len(figures["runs"]) == 4 and figures["thesis"] == PUBLISHED_RMSE["circle"]


@pytest.mark.slow
def test_a_late_pose_makes_a_late_flight() -> None:
    """The delay of the whole system grows with that of the pose, which is not compensated."""
    given = {"compensations": (None,), "controller": CascadeController(), "literal": False}
    prompt = run_experiment("line", 2, **given).runs[0]
    late = run_experiment("line", 2, sensors=Sensors(delay=0.1), **given).runs[0]
    assert abs(late.whole.delay - prompt.whole.delay) > 0.02


def test_one_flight_alone_and_models_by_name() -> None:
    alone = run_experiment("line", 1, compensations=("consistent",))
    assert "without" not in experiment_text(alone).splitlines()[1]
    assert drag_model("exact", Quadrotor.crazyflie()) is not None
    assert isinstance(drag_model("consistent", Quadrotor.dji_f330()), BodyDrag)
    with pytest.raises(VehicleError, match="'perfect'"):
        drag_model("perfect", Quadrotor.dji_f330())
    with pytest.raises(InputError, match="nothing to fly"):
        run_experiment(compensations=())


@pytest.mark.slow
def test_models_belong_to_the_vehicle_they_were_measured_on() -> None:
    small = Quadrotor.crazyflie()
    for name in ("published", "consistent"):
        with pytest.raises(VehicleError, match=f"the {name} model was measured on the DJI F330, not on Crazyflie"):
            drag_model(name, small)
    given = {"vehicle": small, "controller": GeometricController(feed_forward=True), "literal": False}
    without, offset = run_experiment("circle", 1, **given).runs
    assert (without.compensation, offset.compensation) == (None, "exact")
    assert offset.whole.rmse_3d < 0.6 * without.whole.rmse_3d


def test_another_vehicle_is_not_held_against_what_was_flown() -> None:
    small = run_experiment("line", 1, compensations=(None,), vehicle=Quadrotor.crazyflie(), literal=False)
    assert "flown in the thesis" not in experiment_text(small) and experiment_dict(small)["thesis"] is None


def test_a_course_that_the_rotors_cannot_lift_is_refused_with_its_instant() -> None:
    weak = replace(Quadrotor.dji_f330(), mass=2.7)
    with pytest.raises(ThrustError, match=r"at t = \d+\.\d+ s a rotor must give .* N above the most") as caught:
        run_experiment("circle", 1, vehicle=weak)
    assert caught.value.instant >= 5.0 and caught.value.excess > 0


@pytest.mark.slow
def test_progress_covers_all_flights() -> None:
    seen: list[float] = []
    run_experiment("line", 1, compensations=(None, "exact"), progress=seen.append)
    assert seen[0] == 0.0 and seen[-1] == 1.0 and seen == sorted(seen)


def test_the_figure_names_every_flight(circles) -> None:
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure = plot_experiment(circles)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["without compensation", "with published", "with consistent", "with exact", "reference"]
    pyplot.close(figure)
