import numpy as np
import pytest

from minsnap.errors import FileError, FitError, OutsideRangeWarning
from minsnap.flight.thesis import PUBLISHED_PARASITIC, PUBLISHED_PROPELLER, fit_consistent_drag, fit_drag
from minsnap.vehicle import RPM, Quadrotor, fit_thrust_coefficient, fit_torque_coefficient


def bench(seed: int, noise: float = 0.05) -> tuple[np.ndarray, np.ndarray, float]:
    quad = Quadrotor.dji_f330()
    speed = np.linspace(1500, 6000, 30) * RPM
    thrust = quad.thrust_coefficient * speed**2 + np.random.default_rng(seed).normal(0, noise, 30)
    return speed, thrust, quad.thrust_coefficient


def test_the_thrust_coefficient_comes_back_with_an_honest_error() -> None:
    errors = []
    for seed in range(200):
        speed, thrust, true = bench(seed)
        fit = fit_thrust_coefficient(speed, thrust)
        errors.append((fit.value - true) / fit.standard_error)
    assert abs(np.mean(errors)) < 0.3
    assert 0.8 < np.std(errors) < 1.2, "the standard error is that of the scatter"


def test_thrust_fit_agrees_with_numpy() -> None:
    speed, thrust, _ = bench(0)
    fit = fit_thrust_coefficient(speed, thrust)
    expected = np.linalg.lstsq(speed[:, None] ** 2, thrust, rcond=None)[0][0]
    assert fit.value == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(fit.residuals, thrust - expected * speed**2)
    correlation = 1 - np.sum(fit.residuals**2) / np.sum((thrust - thrust.mean()) ** 2)
    assert fit.r_squared == pytest.approx(correlation) and fit.r_squared > 0.99


def test_an_exact_torque_has_no_error() -> None:
    speed = np.array([100.0, 200.0, 300.0])
    fit = fit_torque_coefficient(speed, 2e-7 * speed**2)
    assert fit.value == pytest.approx(2e-7, rel=1e-14) and fit.r_squared == pytest.approx(1.0)
    assert fit.standard_error < 1e-20 and fit.measured == (100.0, 300.0)


def test_evaluating_a_fit_outside_its_range_warns() -> None:
    fit = fit_thrust_coefficient([100.0, 200.0], [1.0, 4.0])
    np.testing.assert_allclose(fit([100.0, 150.0]), [1.0, 2.25])
    with pytest.warns(OutsideRangeWarning, match="rotor speed.*100 to 200, not at 300"):
        assert fit(300.0) == pytest.approx(9.0)


@pytest.mark.parametrize(
    ("speed", "thrust", "says"),
    [
        ([100.0], [1.0], "1 points are too few"),
        ([], [], "0 points"),
        ([1.0, 2.0], [1.0], "differ in length"),
        ([1.0, 2.0, np.nan], [1.0, 2.0, 3.0], "speed holds nan in row 2"),
        ([0.0, 0.0], [1.0, 2.0], "every speed is 0"),
    ],
)
def test_bench_data_that_cannot_be_fitted_are_named(speed, thrust, says) -> None:
    with pytest.raises(FitError, match=says):
        fit_thrust_coefficient(speed, thrust)


def tunnel(seed: int = 0, noise: float = 0.15) -> dict[str, np.ndarray]:
    pitch, speed = np.meshgrid(np.linspace(-20, 20, 17), np.linspace(7, 28, 10))
    drag = PUBLISHED_PARASITIC(pitch_deg=pitch, velocity=speed)
    drag = drag + np.random.default_rng(seed).normal(0, noise, drag.shape)
    return {"pitch_deg": pitch.ravel(), "velocity": speed.ravel(), "drag": drag.ravel()}


def test_the_parasitic_surface_comes_back_within_its_errors() -> None:
    scores = []
    for seed in range(60):
        fit = fit_drag(tunnel(seed), "parasitic")
        scores.append((fit.coefficients - PUBLISHED_PARASITIC.coefficients) / fit.standard_errors)
    assert np.abs(np.mean(scores, axis=0)).max() < 0.5
    assert 0.75 < np.std(scores) < 1.25
    assert fit.r_squared > 0.97
    assert fit.surface.measured == {"pitch_deg": (-20.0, 20.0), "velocity": (7.0, 28.0)}


def test_the_propeller_surface_comes_back_from_clean_data() -> None:
    grid = np.meshgrid(np.linspace(0, 90, 10), np.linspace(0, 15, 6), np.linspace(3000, 8000, 6))
    pitch, speed, rpm = (axis.ravel() for axis in grid)
    drag = PUBLISHED_PROPELLER(pitch_deg=pitch, velocity=speed, speed_rpm=rpm)
    fit = fit_drag({"pitch_deg": pitch, "velocity": speed, "speed_rpm": rpm, "drag": drag}, "propeller")
    np.testing.assert_allclose(fit.coefficients, PUBLISHED_PROPELLER.coefficients, rtol=1e-6)
    assert fit.r_squared == pytest.approx(1.0)


def test_the_covariance_is_that_of_the_normal_equations() -> None:
    data = tunnel()
    fit = fit_drag(data, "reduced")
    design = np.stack([np.ones_like(data["velocity"]), data["velocity"], data["velocity"] ** 2], axis=-1)
    scatter = np.sum(fit.residuals**2) / (len(design) - 3)
    np.testing.assert_allclose(fit.covariance, scatter * np.linalg.inv(design.T @ design), rtol=1e-8)


def test_a_table_is_read_from_a_file_that_may_hold_more(tmp_path) -> None:
    data = tunnel()
    rows = np.column_stack([data["drag"], data["pitch_deg"], data["velocity"], np.arange(170.0)])
    np.savetxt(
        tmp_path / "tunnel.csv", rows, delimiter=",", header="drag,pitch_deg,velocity,run", comments="", fmt="%.17g"
    )
    np.testing.assert_array_equal(fit_drag(tmp_path / "tunnel.csv").coefficients, fit_drag(data).coefficients)


def test_missing_columns_are_named(tmp_path) -> None:
    (tmp_path / "tunnel.csv").write_text("velocity,drag\n7,1\n")
    with pytest.raises(FileError, match="no column pitch_deg"):
        fit_drag(tmp_path / "tunnel.csv")
    with pytest.raises(FitError, match="speed_rpm is missing"):
        fit_drag(tunnel(), "propeller")


def test_too_few_or_too_similar_points_are_named() -> None:
    few = {name: column[:6] for name, column in tunnel().items()}
    with pytest.raises(FitError, match="6 points are too few, it takes 7"):
        fit_drag(few)
    level = tunnel() | {"pitch_deg": np.zeros(170)}
    with pytest.raises(FitError, match="fix 3 of 6 coefficients"):
        fit_drag(level)
    with pytest.raises(FitError, match="'round'.*parasitic"):
        fit_drag(tunnel(), "round")


def test_a_fitted_surface_warns_outside_its_range() -> None:
    fit = fit_drag(tunnel(), "linear")
    with pytest.warns(OutsideRangeWarning, match="fitted linear"):
        fit.surface(velocity=2.0)


def test_the_consistent_fit_finds_a_body_that_is_consistent() -> None:
    pitch, speed = np.meshgrid(np.linspace(-30, 30, 13), np.linspace(1, 20, 20))
    along, up = np.cos(np.radians(pitch)) ** 2, np.sin(np.radians(pitch)) ** 2
    drag = (0.2 * along + 0.1 * up) * speed + (0.01 * along + 0.03 * up) * speed**2
    model, quality = fit_consistent_drag({"pitch_deg": pitch, "velocity": speed, "drag": drag})
    np.testing.assert_allclose(model.linear, [0.2, 0.2, 0.1], atol=1e-8)
    np.testing.assert_allclose(model.quadratic, [0.01, 0.01, 0.03], atol=1e-9)
    assert quality == pytest.approx(1.0)
