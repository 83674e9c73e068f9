"""A heading from the tilt: least rotation at the start, no spin about the thrust axis from there on."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import minsnap
from minsnap.basics.arrays import GRAVITY
from minsnap.errors import YawError
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.tilt_heading import TiltHeading

COURSE = [(0, 0, 1), (3, 1, 3), (5, -2, 2), (1, -3, 1), (-2, 0, 2)]
TIMES = [1.1, 1.0, 1.2, 1.3]
FLIPS = [0.7, 0.6, 0.75, 0.8]


def thrust(traj, t, order=2):
    vector = traj(t, order)
    return vector + [0.0, 0.0, GRAVITY] if order == 2 else vector


def rotations(heading, t):
    """Attitudes as matrices, (m, 3, 3)."""
    return np.stack(heading.axes(np.asarray(t, dtype=float))).transpose(2, 1, 0)


def transported(traj, t):
    """Forward axes by an independent integration of x' = -z (x . z'), from the least rotation to the first thrust."""

    def change(instant, x):
        force, jerk = thrust(traj, instant), thrust(traj, instant, 3)
        size = np.linalg.norm(force)
        z = force / size
        return -z * (x @ (jerk - z * (z @ jerk)) / size)

    z = thrust(traj, 0.0) / np.linalg.norm(thrust(traj, 0.0))
    axis = np.cross([0.0, 0.0, 1.0], z)
    size = np.linalg.norm(axis)
    turn = axis / size * np.arctan2(size, z[2]) if size else axis
    first = Rotation.from_rotvec(turn).apply([1.0, 0.0, 0.0])
    found = solve_ivp(
        change, (0, traj.duration), first, method="DOP853", t_eval=t, rtol=1e-11, atol=1e-12, max_step=0.01
    )
    return found.y


@pytest.mark.slow
@pytest.mark.parametrize("times", [TIMES, FLIPS], ids=["banked", "upside down"])
def test_it_is_the_transport_without_spin(times):
    traj = minsnap.plan(COURSE, times, yaw="tilt", start={"acceleration": (3.0, 2.0, 1.0)})
    t = np.linspace(0.0, traj.duration, 301)
    assert np.stack(traj.yaw.axes(t))[0] == pytest.approx(transported(traj, t), abs=1e-9)
    z = thrust(traj, t)[:, 2] / np.linalg.norm(thrust(traj, t), axis=1)
    assert (z.min() < -0.3) == (times is FLIPS)


def test_it_begins_with_the_least_rotation_from_upright():
    for push in ((0.0, 0.0, 0.0), (4.0, -7.0, 2.0), (0.0, 30.0, -25.0)):
        traj = minsnap.plan(COURSE, TIMES, yaw="tilt", start={"acceleration": push})
        rotation = Rotation.from_matrix(rotations(traj.yaw, [0.0])[0])
        force = np.array(push) + [0.0, 0.0, GRAVITY]
        assert rotation.apply([0, 0, 1]) == pytest.approx(force / np.linalg.norm(force), abs=1e-12)
        tilt = np.arccos(force[2] / np.linalg.norm(force))
        assert rotation.magnitude() == pytest.approx(tilt, abs=1e-7)


def test_a_banked_circle_turns_by_the_solid_angle_of_its_thrust():
    circle = minsnap.circle(radius=2.0, period=2.5, laps=3, ramp=0.0, yaw="tilt")
    t = np.array([0.0, circle.duration / 3.0])
    rate = 2.0 * np.pi / 2.5
    bank = np.arctan(2.0 * rate**2 / GRAVITY)
    first, last = rotations(circle.yaw, t)
    turn = Rotation.from_matrix(first.T @ last).as_rotvec()
    assert np.exp(1j * turn[2]) == pytest.approx(np.exp(2j * np.pi * (1.0 - np.cos(bank))), abs=1e-9)
    assert turn[:2] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_vertical_loop_is_regular_through_upside_down():
    """Thrust that turns about y once: the attitude is that rotation, the yaw never anything but 0 or half a turn."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    push = np.stack([20.0 * np.sin(angle), np.zeros_like(angle), 20.0 * np.cos(angle) - GRAVITY], axis=1)

    class Loop(minsnap.Path):
        duration, dim = 2.0, 3

        def _evaluate(self, t, order):
            phase = np.pi * t + (order - 2) * np.pi / 2.0
            swing = 20.0 * np.pi ** (order - 2) * np.stack([np.sin(phase), np.zeros_like(t), np.cos(phase)], axis=1)
            return swing - [0.0, 0.0, GRAVITY] if order == 2 else swing

    heading = TiltHeading(Loop())
    assert Loop()(angle / np.pi, 2) == pytest.approx(push)
    expected = Rotation.from_rotvec(angle[:, None] * [0.0, 1.0, 0.0]).as_matrix()
    assert rotations(heading, angle / np.pi) == pytest.approx(expected, abs=1e-9)
    assert np.sin(heading(angle / np.pi)) == pytest.approx(0.0, abs=1e-9)


def test_derivatives_are_exact():
    traj = minsnap.plan(COURSE, FLIPS, yaw="tilt")
    t, step = np.linspace(0.02, traj.duration - 0.02, 97), 1e-5
    x, first, second = traj.yaw.forward(t)
    (ahead, ahead_first, _), (back, back_first, _) = (traj.yaw.forward(t + sign * step) for sign in (1.0, -1.0))
    assert (ahead - back) / (2.0 * step) == pytest.approx(first, abs=1e-6 * np.abs(first).max())
    assert (ahead_first - back_first) / (2.0 * step) == pytest.approx(second, abs=1e-6 * np.abs(second).max())
    for order in (1, 2):
        slope = (traj.yaw(t + step, order - 1) - traj.yaw(t - step, order - 1)) / (2.0 * step)
        exact = traj.yaw(t, order)
        assert slope == pytest.approx(exact, abs=1e-5 * np.abs(exact).max())


def test_the_yaw_is_that_of_the_attitude_and_never_jumps():
    traj = minsnap.plan(COURSE, TIMES, yaw="tilt")
    t = np.linspace(0.0, traj.duration, 4001)
    lateral, yaw = traj.yaw.axes(t)[1], traj.yaw(t)
    assert np.cos(yaw) * lateral[0] + np.sin(yaw) * lateral[1] == pytest.approx(0.0, abs=1e-12)
    assert (np.cos(yaw) * lateral[1] - np.sin(yaw) * lateral[0]).min() > 0.0
    assert np.abs(np.diff(yaw)).max() < 0.05 and yaw[0] == 0.0


def test_samples_and_files_carry_it(tmp_path):
    traj = minsnap.plan(COURSE, TIMES, yaw="tilt")
    samples = traj.sample(100.0)
    assert samples.yaw == pytest.approx(traj.yaw(samples.t.clip(max=traj.duration)))
    minsnap.write_csv(traj, tmp_path / "t.csv", rate=100.0)
    read = minsnap.read_csv(tmp_path / "t.csv")
    assert (read.yaw == samples.yaw).all() and (read.yaw_rate == samples.yaw_rate).all()


def test_parts_and_joins_keep_the_attitude():
    traj = minsnap.plan(COURSE, FLIPS, yaw="tilt")
    for start in (0.6, 1.5, 1.9):
        part, t = traj.between(start, 2.6), np.linspace(start, 2.6, 40)
        assert rotations(part.yaw, t - start) == pytest.approx(rotations(traj.yaw, t), abs=1e-9)
        whole, t = traj.between(0.0, start).then(traj.between(start, 2.6)), np.linspace(0.0, 2.6, 40)
        assert rotations(whole.yaw, t) == pytest.approx(rotations(traj.yaw, t), abs=1e-9)
    back, t = traj.reversed(), np.linspace(0.0, traj.duration, 40)
    assert rotations(back.yaw, traj.duration - t) == pytest.approx(rotations(traj.yaw, t), abs=1e-9)


def test_slower_flight_tilts_less_and_so_turns_less():
    traj = minsnap.plan(COURSE, TIMES, yaw="tilt")
    slow = traj.stretched(2.0)
    again = TiltHeading(slow)
    t = np.linspace(0.0, slow.duration, 50)
    assert rotations(slow.yaw, t) == pytest.approx(rotations(again, t), abs=1e-12)
    assert np.ptp(slow.yaw(t)) < 0.5 * np.ptp(traj.yaw(t / 2.0))


def test_it_knows_of_other_gravity():
    moon = TiltHeading(minsnap.plan(COURSE, TIMES), medium=Medium(1.62))
    t = np.linspace(0.0, sum(TIMES), 20)
    z = np.stack(moon.axes(t))[2]
    force = moon.path(t, 2) + [0.0, 0.0, 1.62]
    assert z.T == pytest.approx(force / np.linalg.norm(force, axis=1)[:, None], abs=1e-12)


def test_plane_paths_have_it_and_lines_have_not():
    flat = minsnap.plan([(0, 0), (2, 1), (4, 0)], [1.0, 1.0], yaw="tilt")
    spatial = minsnap.plan([(0, 0, 5), (2, 1, 5), (4, 0, 5)], [1.0, 1.0], yaw="tilt")
    t = np.linspace(0.0, 2.0, 11)
    assert rotations(flat.yaw, t) == pytest.approx(rotations(spatial.yaw, t), abs=1e-9)
    with pytest.raises(YawError, match="two or three coordinates, this path has 1"):
        minsnap.plan([[0.0], [1.0]], [1.0], yaw="tilt")
    with pytest.raises(YawError, match="up to order 2, not 3"):
        flat.yaw(0.5, 3)


def test_free_fall_leaves_everything_finite():
    drop = minsnap.plan([(0, 0, 9), (0.5, 0, 0)], [1.0], yaw="tilt", start={"velocity": (0, 0, -1)})
    t = np.linspace(0.0, 1.0, 501)
    assert all(np.isfinite(drop.yaw(t, order)).all() for order in range(3))
    assert np.isfinite(np.stack(drop.yaw.axes(t))).all()
