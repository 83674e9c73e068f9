"""Files of shows keep the limits of the show: as the firmware's rules play them, written out here, in every format.

Nothing of the readers of the package is used: bytes are decoded by their formats, velocities and accelerations are
those of Bernstein polynomials in whole units, their largest values exact, by the roots of their derivatives, and
velocities that step at knots count over a tenth of a second.
"""

import json
import math
import runpy
import struct
import sys
import zipfile
from math import comb
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.shows.acts import Act, Show
from minsnap.shows.file_limits import certify_files, use_of_files
from minsnap.shows.firmware_take_off import late_by
from minsnap.shows.formations import circle, grid
from minsnap.shows.moves import Move
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

DOCS = Path(__file__).parents[2] / "docs" / "shows.rst"
EXAMPLE = Path(__file__).parents[2] / "examples" / "fleet_show.py"


def segments_of(content, offset, end, place, scales):
    """Segments of a binary trajectory: seconds, and the control points of x, y, z in metres."""
    while offset < end:
        kinds, lasts = struct.unpack_from("<BH", content, offset)
        offset += 3
        if lasts == 0:
            return
        axes = []
        for axis, scale in enumerate(scales):
            count = (0, 1, 3, 7)[kinds >> 2 * axis & 3]
            row = [place[axis], *struct.unpack_from(f"<{count}h", content, offset)]
            offset, place[axis] = offset + 2 * count, row[-1]
            axes.append(scale * np.array(row, dtype=float))
        yield lasts / 1e3, axes[:3]


def vehicles_in(folder, to):
    """Segments of each vehicle, as the player of the format has them."""
    if to == "traj":  # the Crazyflie: four int16, then segments until one of 0 ms
        for content in (file.read_bytes() for file in sorted(folder.glob("*.traj"))):
            yield list(segments_of(content, 8, len(content), list(struct.unpack_from("<4h", content)), [1e-3] * 4))
    elif to == "skyb":  # Skybrush: block 1 comes first; a unit, four int16, then segments to its end
        for content in (file.read_bytes() for file in sorted(folder.glob("*.skyb"))):
            scale, *place = struct.unpack_from("<B4h", content, 13)
            end = 13 + struct.unpack_from("<H", content, 11)[0]
            yield list(segments_of(content, 13 + 9, end, place, [scale * 1e-3] * 4))
    elif to == "skyc":  # its server: units chosen by the farthest coordinate, coordinates and milliseconds cut off
        with zipfile.ZipFile(folder / "show.skyc") as archive:
            drones = json.loads(archive.read("show.json"))["swarm"]["drones"]
            for drone in drones:
                name = drone["settings"]["trajectory"]["$ref"].strip("./#")
                yield list(cut_off(json.loads(archive.read(name))["points"]))
    else:  # 33 numbers a piece, ascending powers of seconds
        for file in sorted(folder.glob("traj*.csv")):
            rows = np.loadtxt(file, delimiter=",", skiprows=1)
            yield [(row[0], [bernstein(row[1 + 8 * k : 9 + 8 * k], row[0]) for k in range(3)]) for row in rows]


def cut_off(points):
    farthest = max(abs(x) for _, end, between in points for place in (end, *between) for x in place)
    scale = math.ceil((math.ceil(farthest * 1000) + 1) / 32768)
    for (begin, start, _), (end, goal, between) in zip(points, points[1:], strict=False):
        whole = [[int(x * (1000 / scale)) for x in place] for place in (start, *between, goal)]
        yield math.floor(round(end - begin, 3) * 1000) / 1e3, list(scale * 1e-3 * np.array(whole, dtype=float).T)


def bernstein(powers, lasts):
    """Control points of a polynomial in seconds."""
    n, c = len(powers) - 1, powers * lasts ** np.arange(len(powers))
    return np.array([sum(comb(i, k) / comb(n, k) * c[k] for k in range(i + 1)) for i in range(n + 1)])


def derivative(points, lasts):
    return (len(points) - 1) * np.diff(points) / lasts if len(points) > 1 else np.zeros(1)


def power_form(points):
    """Coefficients of 1, s, s², ..."""
    n = len(points) - 1
    return [comb(n, k) * sum((-1) ** (k - i) * comb(k, i) * points[i] for i in range(k + 1)) for k in range(n + 1)]


def largest(axes):
    """The largest norm of a curve over [0, 1], by the roots of the derivative of its square."""
    curves = [np.polynomial.Polynomial(power_form(points)) for points in axes]
    square = sum((curve * curve for curve in curves), np.polynomial.Polynomial([0.0]))
    roots = square.deriv().roots() if square.degree() > 0 else []
    inner = [root.real for root in np.atleast_1d(roots) if abs(root.imag) < 1e-6 and 0.0 < root.real < 1.0]
    return math.sqrt(max(float(square(s)) for s in (0.0, 1.0, *inner)))


def played(segments):
    """Shortest segment [s], largest speed, largest acceleration, and that with the steps of the velocity at knots."""
    speed = hardest = counted = 0.0
    last = None
    for lasts, axes in segments:
        slopes = [derivative(points, lasts) for points in axes]
        bends = [derivative(points, lasts) for points in slopes]
        ends = [np.array([[points[k] for points in each] for each in (slopes, bends)]) for k in (0, -1)]
        if last is not None:
            step = np.linalg.norm(ends[0][0] - last[0])
            counted = max(counted, step / 0.1 + max(np.linalg.norm(last[1]), np.linalg.norm(ends[0][1])))
        speed, hardest, last = max(speed, largest(slopes)), max(hardest, largest(bends)), ends[1]
    return min(lasts for lasts, _ in segments), speed, hardest, max(hardest, counted)


def travel_time(height, speed, acceleration):
    """libskybrush's time for a way, from rest to rest."""
    if height >= speed * speed / acceleration:
        return 2.0 * speed / acceleration + (height - speed * speed / acceleration) / speed
    return 2.0 * math.sqrt(height / acceleration)


def take_off(segments, speed, acceleration):
    """When Skybrush's firmware proposes to take off: its own climb ends when the curve is 2.5 m above its start."""
    clock, target = 0.0, segments[0][1][2][0] + 2.5
    for lasts, (_, _, z) in segments:
        height = np.polynomial.Polynomial(power_form(z)) - target
        met = [r.real for r in np.atleast_1d(height.roots()) if abs(r.imag) < 1e-9 and -1e-9 <= r.real <= 1.0 + 1e-9]
        if met:
            return clock + min(met) * lasts - travel_time(2.5, speed, acceleration)
        clock += lasts
    return math.inf


def shown(text):
    """The show of the page on shows."""
    lines = text.split("vehicles: 24", 1)[1].split("\n::", 1)[0]
    return "vehicles: 24" + "\n".join(line[4:] for line in lines.split("\n")).replace("vehicles: 24", "")


def planned(folder, show, to):
    """Exit status of ``minsnap fleet``."""
    with pytest.raises(SystemExit) as left:
        main(["fleet", str(show), "-o", str(folder), "--to", to])
    return left.value.code or 0


@pytest.mark.slow
@pytest.mark.parametrize("to", ["csv", "skyb", "skyc", "traj"])
def test_the_show_of_the_page_keeps_its_limits_in_every_format(tmp_path, to):
    """Files reached 3.86 m/s^2 of 3 as a .skyc, 105 as .traj, and take-offs would have begun 1 to 2 s before zero."""
    (tmp_path / "show.yaml").write_text(shown(DOCS.read_text()))
    assert planned(tmp_path / "out", tmp_path / "show.yaml", to) == 0
    vehicles = list(vehicles_in(tmp_path / "out", to))
    assert len(vehicles) == 24
    for segments in vehicles:
        shortest, speed, hardest, counted = played(segments)
        assert speed <= 4.0 + 1e-9 and hardest <= counted <= 3.0 + 1e-7, (speed, hardest, counted)
        assert hardest >= 1.0
        if to != "csv":
            assert shortest >= 0.1
            assert min(z.min() for _, (_, _, z) in segments) >= -1e-9, "nobody dips below the ground"
        if to in ("skyb", "skyc"):
            assert 0.0 <= take_off(segments, 1.0, 4.0) and 0.0 <= take_off(segments, 2.5, 1.0) <= 0.5


@pytest.mark.slow
def test_the_example_keeps_its_limits(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE), str(tmp_path)])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    for segments in vehicles_in(tmp_path, "skyc"):
        shortest, speed, _, counted = played(segments)
        assert speed <= 4.0 and counted <= 3.0 and shortest >= 0.1 and take_off(segments, 2.5, 1.0) >= 0.0
    assert "<b>Apart at every instant.</b>" in (tmp_path / "report.html").read_text()


def small(**how):
    """Four vehicles, a circle that turns, and home."""
    act = Act("ring", circle(4, 3.0, 6.0), moves=(Move(np.pi),))
    limits = how.pop("limits", minsnap.Limits(speed=3, acceleration=2))
    return Show(grid(4, 2.0), (act,), minsnap.Separation(1.0), limits, **how)


@pytest.mark.parametrize("to", ["skyc", "traj"])
def test_flights_that_jump_are_slowed_until_the_file_keeps_the_limits(to):
    """Without a limit on the jerk straight flights have pieces of 20 ms."""
    show, told = small(smooth=False), []
    rough = fly(show, None, told.append, to=to)
    assert any("slowed by" in line for line in told)
    smooth = fly(small(), to=to)
    for flown in (rough, smooth):
        held = minsnap.Fleet(tuple(flown.fleet))
        assert certify_files(held, show.separation, show.limits, None, to).ok
    plain = fly(small())
    assert plain.fleet.duration < smooth.fleet.duration < 1.35 * plain.fleet.duration
    hardest = max(curve.max_norm(3)[0] for curve in plain.fleet)
    assert hardest <= 6.0 + 1e-6, "three times the acceleration, a second"


def test_a_show_may_say_its_jerk_or_none(tmp_path):
    text = "vehicles: 4\nseparation: 1\nlimits: {speed: 3, acceleration: 2%s}\nhome: {grid: {spacing: 2}}\n"
    text += "environment: indoor\ntake_off: {height: 3, speed: 0.8, wait: 1.5}\nland: {speed: 0.5, place: any}\n"
    text += "acts: [{formation: {circle: {radius: 3, height: 6}}}]\n"
    for said, jerk in (("", 6.0), (", jerk: 4", 4.0), (", jerk: null", None)):
        (tmp_path / "show.yaml").write_text(text % said)
        show = read_show(tmp_path / "show.yaml")
        assert show.flown_limits.jerk == pytest.approx(jerk)
    assert (show.take_off, show.climb_speed, show.wait, show.descent_speed) == (3, 0.8, 1.5, 0.5)
    assert (show.land, show.environment) == ("any", "indoor")
    flown = fly(show)
    up, down = flown.stages[0], flown.stages[-1]
    assert up.start == 1.5 and flown.fleet(1.5) == pytest.approx(show.home)
    t = np.linspace(0.0, flown.fleet.duration, 3001)
    climbing = flown.fleet(t, 1)[..., 2]
    assert climbing[:, t <= up.arrival].max() == pytest.approx(0.8, abs=1e-3)
    assert climbing[:, t >= down.start].min() == pytest.approx(-0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("how", "sentence"),
    [({"climb_speed": 0.0}, "the speed of take_off is 0.0"), ({"wait": -1.0}, "the wait before take_off is -1.0")],
)
def test_take_offs_that_cannot_be_are_refused(how, sentence):
    with pytest.raises(minsnap.errors.FleetError, match=sentence):
        fly(small(**how))


def test_skybrush_climbs_gently_after_a_wait_and_says_where_it_cannot(tmp_path, capsys):
    show = small(take_off=3.0)
    flown = fly(show, to="skyb")
    assert late_by(flown.fleet) <= 0.0 < late_by(fly(show).fleet) + 0.5
    sheet = flown.sheet(show, "a")
    assert sheet.segments["takeoff"] == (0.0, flown.stages[0].end) and sheet.cues[0][1] == "ring"
    assert sheet.segments["landing"] == (flown.stages[-1].start, flown.stages[-1].end)
    text = "vehicles: 2\nseparation: 1\nlimits: {speed: 3, acceleration: 2}\nhome: {grid: {spacing: 2}}\n"
    text += "take_off: {height: %s, speed: 2, wait: 0}\nacts: [{formation: {circle: {radius: 3, height: %s}}}]\n"
    for heights, said in (((4, 6), "would have to take off"), ((1, 2), "never rises by 2.5 m")):
        (tmp_path / "show.yaml").write_text(text % heights)
        assert planned(tmp_path / "out", tmp_path / "show.yaml", "skyb") == 1
        assert said in capsys.readouterr().out


def test_a_step_of_the_velocity_counts_over_a_tenth_of_a_second():
    lines = np.array([[[0.0, 0, 0], [1, 0, 0]], [[1.0, 0, 0], [2.02, 0, 0.03]]])
    held = minsnap.Fleet((minsnap.Trajectory(lines, [1.0, 1.0]),))
    limits = minsnap.Limits(acceleration=0.3, horizontal_acceleration=1.0, vertical_acceleration=1.0, jerk=1.0)
    uses = {used.use.name: used.use for used in use_of_files(held, limits)}
    assert uses["acceleration"].value == pytest.approx(np.hypot(0.02, 0.03) / 0.1)
    assert uses["horizontal_acceleration"].value == pytest.approx(0.2)
    assert uses["vertical_acceleration"].value == pytest.approx(0.3) and uses["acceleration"].instant == 1.0
    assert not uses["acceleration"].kept and "jerk" not in uses


def test_files_beyond_the_limits_are_amber_and_a_problem(tmp_path, capsys, monkeypatch):
    """Exit 0, a green box and a note, at 34 m/s^2 of 1.5."""
    monkeypatch.setattr("minsnap.shows.show_course.ROUNDED_KINDS", ())
    text = "vehicles: 4\nseparation: 1\nlimits: {speed: 3, acceleration: 2, jerk: null}\nhome: {grid: {spacing: 2}}\n"
    (tmp_path / "show.yaml").write_text(text + "acts: [{formation: {circle: {radius: 3, height: 6}}}]\n")
    page = tmp_path / "report.html"
    with pytest.raises(SystemExit, match="1"):
        main(["fleet", str(tmp_path / "show.yaml"), "-o", str(tmp_path / "out"), "--to", "traj", "--report", str(page)])
    said, html = capsys.readouterr().out, page.read_text()
    assert "problem: the files reach acceleration" in said and "apart at every instant" in said
    assert '<p class="exceeds"><b>Apart at every instant, and beyond its limits.</b>' in html
    assert "steps of the velocity" in html


@pytest.mark.parametrize("more", [{"yaw_rate": 2.0}, {"tilt": 1.0}, {"max_thrust": 3.0}])
def test_a_limit_that_no_flight_uses_slows_none(more):
    """Limits that no time scales slowed every flight by 0.2 % in each of 30 rounds."""
    durations = []
    for limits in (minsnap.Limits(speed=3, acceleration=2), minsnap.Limits(speed=3, acceleration=2, **more)):
        show = Show(grid(2, 3.0), (Act("up", grid(2, 3.0, 6.0), 1.0),), minsnap.Separation(1.0), limits)
        durations.append(fly(show, to="skyc").fleet.duration)
    assert durations[0] == durations[1]
