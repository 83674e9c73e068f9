"""Converting by the command."""

import numpy as np

import minsnap


def test_formats_by_their_endings_and_by_name(call, tmp_path):
    assert call("rect", "-o", "rect.csv").returncode == 0
    assert call("convert", "rect.csv", "rect.parquet", "--frame", "ned").stdout == "rect.parquet: parquet, frame ned\n"
    done = call("convert", "rect.parquet", "cf.csv", "--to", "crazyflie")
    assert done.returncode == 0 and done.stdout == "cf.csv: crazyflie, frame enu\n"
    assert np.loadtxt(tmp_path / "cf.csv", delimiter=",", skiprows=1, usecols=range(33)).shape[0] <= 31
    assert call("convert", "cf.csv", "back.csv").returncode == 0
    first, back = minsnap.read_csv(tmp_path / "rect.csv"), minsnap.read_csv(tmp_path / "back.csv")
    count = min(len(first), len(back)) - 1
    np.testing.assert_allclose(back.position[:count], first.position[:count], atol=1.5e-3)


def test_refusals(call, tmp_path):
    assert call("convert", "none.csv", "a.npz").returncode == 2
    (tmp_path / "a.npz").write_bytes(b"")
    call("rect", "-o", "rect.csv")
    kept = call("convert", "rect.csv", "a.npz", "--no-clobber")
    assert kept.returncode == 2 and "a.npz is there already" in kept.stderr
    assert call("convert", "rect.csv", "a.npz", "--to", "paper").stderr.startswith(
        "minsnap: no format is called 'paper'"
    )
