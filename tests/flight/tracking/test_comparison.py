from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.flight import compare, plot_tracking
from minsnap.flight.tracking.comparison import comparison_text, distance_to_curve, moved, position_at
from minsnap.trajectory.samples import Samples


@pytest.fixture
def eight():
    return minsnap.lemniscate(laps=2)


def flown(path, delay: float = 0.0, rate: float = 50.0, change=lambda position: position) -> Samples:
    t = np.arange(0, path.duration, 1 / rate)
    return Samples(t, change(path(np.clip(t - delay, 0, path.duration))))


def test_a_perfect_flight_has_no_error(eight) -> None:
    found = compare(eight.sample(20.0), flown(eight))
    assert found.rmse_3d < 2e-4 and found.path_max < 2e-4 and abs(found.delay) < 1e-4


@pytest.mark.parametrize("delay", [0.013, 0.137, 0.5, 1.21, -0.3])
def test_a_delay_is_found_to_a_millisecond_and_taken_off(eight, delay) -> None:
    found = compare(eight.sample(20.0), flown(eight, delay))
    assert found.delay == pytest.approx(delay, abs=1e-3)
    assert found.late_rmse_3d < 0.005 < found.rmse_3d
    assert found.path_rmse < 2e-4, "in shape there is no error"
    assert found.time_rmse == pytest.approx(found.rmse_3d, rel=1e-3)


def test_a_delay_is_found_on_a_line(delay=0.3) -> None:
    """Signals were centered before they were shifted: on a line of 20 s a delay of 0.3 s was found 0.16 s early."""
    line = minsnap.line((0, 0, 2), (12, 0, 2), total_time=20.0)
    assert compare(line.sample(20.0), flown(line, delay)).delay == pytest.approx(delay, abs=1e-3)


def test_an_offset_of_the_position_is_no_delay(delay=0.2) -> None:
    """The refinement counted a constant offset as distance: 0.2 m of it made of 0.2 s at 10 Hz 0.3 s."""
    random = np.random.default_rng(1)
    for _ in range(10):
        path = minsnap.plan(random.uniform(-3, 3, (6, 3)), total_time=12.0)
        offset = random.normal(size=3) * 0.3
        found = compare(path.sample(10.0), flown(path, delay, 10.0, lambda position, by=offset: position + by))
        assert found.delay == pytest.approx(delay, abs=1e-3)


def test_a_flight_at_constant_speed_that_is_its_plan_is_not_late() -> None:
    """Every lag leaves a constant distance there: one of 14 ms was told, with 0.07 m that it left."""
    at = np.arange(101)
    plan = Samples(0.05 * at, at[:, None] * [0.25, 0.0, 0.0])
    found = compare(plan, plan)
    assert found.delay == found.rmse_3d == found.late_rmse_3d == 0.0


def without(samples: Samples, start: float, end: float) -> Samples:
    """Samples with a gap."""
    return samples[(samples.t < start) | (samples.t > end)]


@pytest.mark.parametrize("cut", ["flight", "reference"])
def test_gaps_are_left_out_of_every_figure_and_told(cut) -> None:
    """Straight lines were drawn across gaps: one of 4 s made a delay of 0.1 s one of 0.2 s, without a word."""
    random, delay = np.random.default_rng(1), 0.1
    for _ in range(10):
        path = minsnap.plan(random.uniform(-3, 3, (6, 3)), total_time=12.0)
        start = random.uniform(1.0, 7.0)
        given = {"reference": path.sample(20.0), "flight": flown(path, delay, rate=20.0)}
        found = compare(**given | {cut: without(given[cut], start, start + 4.0)})
        assert found.delay == pytest.approx(delay, abs=1e-3) and found.late_rmse_3d < 2e-3
        assert np.abs(found.error).max() <= np.abs(compare(**given).error).max() + 1e-9
        [[before, after]] = found.as_dict()["gaps"]
        sentence = f"samples are missing for {after - before:.2f} s, which are left out: the longest gap is from"
        assert after - before == pytest.approx(4.15, abs=0.16)
        assert str(found).splitlines()[-1].startswith(sentence) and sentence in found.remarks()[0]


def test_an_offset_in_shape_is_no_error_in_time(eight) -> None:
    found = compare(eight.sample(20.0), flown(eight, change=lambda position: position + [0, 0, 0.25]))
    np.testing.assert_allclose(found.rmse, [0, 0, 0.25], atol=2e-4)
    assert found.path_rmse == pytest.approx(0.25, abs=1e-4) and found.time_rmse < 0.005
    assert found.rmse_3d == pytest.approx(0.25, abs=1e-4) == pytest.approx(found.max_error, abs=1e-3)


def test_figures_by_hand() -> None:
    reference = Samples(np.arange(4.0), np.zeros((4, 3)))
    position = np.array([[3.0, 0, 0], [0, 4.0, 0], [0, 0, 0], [0, 0, 12.0]])
    found = compare(reference, Samples(np.arange(4.0), position))
    np.testing.assert_allclose(found.rmse, [1.5, 2.0, 6.0])
    assert found.rmse_3d == 6.5 and found.max_error == 12.0 and found.delay == 0.0
    np.testing.assert_allclose(found.path_error, [3, 4, 0, 12])


@pytest.mark.parametrize("offset", [-312.7, 40.0])
def test_clocks_are_aligned(eight, offset) -> None:
    log = flown(eight, rate=30.0)
    found = compare(eight.sample(20.0), moved(log, offset), align=True)
    assert found.offset == pytest.approx(-offset, abs=2e-3) and found.rmse_3d < 0.005
    with pytest.raises(InputError, match="no time in common: compare them with align=True"):
        compare(eight.sample(20.0), moved(log, 1000.0))


def test_clocks_that_are_decades_apart_are_aligned_as_well(eight) -> None:
    """A flight on the clock of Unix was 2 cm off: the search ended at a share of the offset, not of a step."""
    for clock in (0.0, 1.7e9):
        found = compare(eight.sample(20.0), moved(flown(eight, rate=20.0), clock + 0.0137), align=True)
        assert found.offset == pytest.approx(-clock - 0.0137, abs=1e-5, rel=0.0) and found.rmse_3d < 1e-4


def test_a_log_with_waiting_before_and_after_is_aligned(eight) -> None:
    middle = flown(eight)
    still = [np.tile(middle.position[end], (750, 1)) for end in (0, -1)]
    position = np.concatenate([still[0], middle.position, still[1]])
    log = Samples(100.0 + np.arange(len(position)) / 50.0, position)
    assert compare(eight.sample(20.0), log, align=True).offset == pytest.approx(-115.0, abs=5e-3)


def test_parts_keep_the_delay_of_the_whole(eight) -> None:
    found = compare(eight.sample(20.0), flown(eight, 0.2))
    part = found.within(2.0, 4.0)
    assert 2.0 <= part.t[0] and part.t[-1] <= 4.0 and part.delay == found.delay
    with pytest.raises(InputError, match="nothing was flown between 90"):
        found.within(90.0, 91.0)


def test_distance_to_a_curve_is_that_of_a_dense_search(eight) -> None:
    random = np.random.default_rng(0)
    points = random.uniform((-4, -2, 1), (4, 2, 2), (40, 3))
    dense = eight(np.linspace(0, eight.duration, 200_001))
    brute = [np.linalg.norm(dense - point, axis=1).min() for point in points]
    np.testing.assert_allclose(distance_to_curve(points, eight.sample(20.0)), brute, atol=2e-4)


def test_distance_to_uneven_chords_and_to_a_point() -> None:
    corner = Samples(np.arange(3.0), np.array([[0, 0], [100.0, 0], [100.0, 0.01]]))
    np.testing.assert_allclose(distance_to_curve(np.array([[50.0, 3.0], [-4.0, 3.0]]), corner), [3.0, 5.0])
    lone = Samples(np.arange(2.0), np.ones((2, 2)))
    np.testing.assert_allclose(distance_to_curve(np.array([[4.0, 5.0]]), lone), [5.0])


def test_position_between_samples_uses_velocity_where_there_is_any(eight) -> None:
    samples, t = eight.sample(20.0), np.linspace(0, eight.duration, 777)
    assert np.abs(position_at(samples, t) - eight(t)).max() < 2e-5
    assert np.abs(position_at(replace(samples, velocity=None), t) - eight(t)).max() > 1e-4


def test_dimensions_must_agree(eight) -> None:
    flat = Samples(np.arange(3.0), np.zeros((3, 2)))
    with pytest.raises(InputError, match="3 coordinates and the flight 2"):
        compare(eight.sample(20.0), flat)


TIMES = "instants: it needs one or more, each later than the one before"


@pytest.mark.parametrize("spoilt", ["reference", "flight"])
@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda samples: samples[[0, *range(len(samples))]], TIMES),
        (lambda samples: samples[::-1], TIMES),
        (lambda samples: samples[:0], f"0 {TIMES}"),
        (lambda samples: replace(samples, velocity=np.nan * samples.velocity), "numbers in velocity that"),
    ],
)
def test_samples_that_cannot_be_compared_are_refused_in_a_sentence(eight, spoilt, change, sentence) -> None:
    """Instants given twice and velocities of NaN were errors of SciPy, no samples an IndexError.

    Samples out of order gave a delay of 0.
    """
    given = {"reference": eight.sample(20.0), "flight": eight.sample(20.0)}
    with pytest.raises(InputError, match=f"the {spoilt} has .*{sentence}"):
        compare(**given | {spoilt: change(given[spoilt])})


def test_the_report_names_every_figure(eight) -> None:
    found = compare(eight.sample(20.0), flown(eight, 0.1))
    text = comparison_text({"one.csv": found})
    assert str(found) == comparison_text({"flight": found})
    assert text.startswith("Root mean squared error [m], in axes with z up\n")
    assert "one.csv" in text and f"{found.rmse_3d:.4f}" in text and "from the curve" in text
    numbers = found.as_dict()
    assert numbers["rmse_3d"] == found.rmse_3d and set(numbers["rmse"]) == {"x", "y", "z"}


def test_the_figure_shows_every_flight(eight) -> None:
    import matplotlib

    matplotlib.use("agg")

    figure = plot_tracking(eight.sample(20.0), {"a": flown(eight), "b": flown(eight, 0.2)}, "two flights")
    plane, *profiles = figure.axes
    assert len(plane.lines) == 3 and [ax.get_ylabel() for ax in profiles] == [
        "$x$ [m]",
        "$y$ [m]",
        "$v_x$ [m/s]",
        "$v_y$ [m/s]",
    ]
    gapped = plot_tracking(without(eight.sample(20.0), 1.0, 2.0), {"a": without(flown(eight), 3.0, 4.5)})
    for ax in gapped.axes:
        flight, reference = (np.isnan(line.get_data()[-1]).sum() for line in ax.lines)
        assert flight == reference == 1, "a line is drawn across a gap"
