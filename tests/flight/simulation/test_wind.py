import numpy as np
import pytest
from scipy.signal import welch

from minsnap.errors import InputError
from minsnap.flight import ConstantWind, DrydenWind


def test_constant_wind_is_constant() -> None:
    np.testing.assert_array_equal(ConstantWind((1, 2, 3)).sample(4, 0.1), [[1, 2, 3]] * 4)


@pytest.mark.slow
def test_gusts_have_the_spectra_of_the_standard() -> None:
    wind = DrydenWind((4.0, 0, 0), intensity=(1.0, 0.8, 0.5), length=(8.0, 6.0, 4.0), seed=1)
    series = wind.sample(400_000, 0.02)
    np.testing.assert_allclose(series.std(axis=0), [1.0, 0.8, 0.5], rtol=0.03)
    np.testing.assert_allclose(series.mean(axis=0), [4.0, 0, 0], atol=0.06)
    frequency, power = welch(series - series.mean(axis=0), fs=50.0, nperseg=4096, axis=0)
    chosen = (frequency > 0.05) & (frequency < 5)
    omega = 2 * np.pi * frequency[chosen]
    for axis, (sigma, time) in enumerate(((1.0, 2.0), (0.8, 1.5), (0.5, 1.0))):
        square = (time * omega) ** 2
        # one-sided density in Hz of the printed transfer functions, driven by two-sided white noise of density 1
        shape = 2 / (1 + square) if axis == 0 else (1 + 3 * square) / (1 + square) ** 2
        np.testing.assert_allclose(np.median(power[chosen, axis] / (2 * sigma**2 * time * shape)), 1.0, atol=0.06)


def test_gusts_across_the_wind_turn_with_it() -> None:
    north = DrydenWind((0.0, 5.0, 0.0), intensity=(1.0, 0.0, 0.0)).sample(1000, 0.02)
    assert north[:, 1].std() > 0.1 and np.abs(north[:, 0]).max() < 1e-12


def test_a_seed_repeats_the_gusts_and_a_longer_series_begins_alike() -> None:
    one = DrydenWind(seed=7).sample(100, 0.01)
    np.testing.assert_array_equal(DrydenWind(seed=7).sample(500, 0.01)[:100], one)
    assert np.abs(DrydenWind(seed=8).sample(100, 0.01) - one).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.001, 0.1])
def test_the_first_instant_is_already_stationary(step: float) -> None:
    first = np.array([DrydenWind(seed=seed).sample(3, step)[2] for seed in range(2000)])
    np.testing.assert_allclose(first.std(axis=0), [0.5, 0.5, 0.25], rtol=0.06)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"mean": (1, 2)}, "mean wind"),
        ({"intensity": (-1, 0, 0)}, "gust intensity"),
        ({"length": (0, 1, 1)}, "above 0"),
        ({"airspeed": 0.0}, "above 0"),
        ({"mean": (np.nan, 0, 0)}, "finite"),
    ],
)
def test_gusts_that_cannot_be_are_named(values, says) -> None:
    with pytest.raises(InputError, match=says):
        DrydenWind(**values)
