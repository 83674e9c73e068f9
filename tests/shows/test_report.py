"""The report of a show: as HTML and as PDF, with the energy of each vehicle and the walls that count."""

import re
import zlib
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.basics.arrays import GRAVITY
from minsnap.cli.app import main
from minsnap.files.formats import Lights
from minsnap.plot.page_files import write_parts
from minsnap.plot.pages import Drawing, Note, Signature, Table, Verdict
from minsnap.shows.energy import AIR, PowerModel
from minsnap.shows.light_figure import light_figure
from minsnap.shows.show_yaml import read_show

SHOW = """
vehicles: 4
separation: 1.0
limits: {speed: 4, acceleration: 3}
room: [[-9, -9, -0.1], [9, 9, 30]]
energy: {mass: 0.9, rotor_radius: 0.09, battery: 38}
home: {grid: {spacing: 2.0}}
take_off: 3
acts:
  - {name: ring, formation: {circle: {radius: 5, height: 10}}, hold: 1}
"""


def status_of(*words):
    """Return the exit status of a command."""
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return ended.value.code or 0


def pages_of(pdf: bytes) -> int:
    """Return how many pages a PDF has, and refuse one of which a stream is not whole."""
    for found in re.finditer(rb"/FlateDecode.*?>>\s*stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL):
        zlib.decompressobj().decompress(found.group(1))
    return len(re.findall(rb"/Type /Page\b(?!s)", pdf))


def test_a_report_is_written_as_pdf_or_html(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("show.yaml").write_text(SHOW)
    for name in ("r.html", "r.pdf"):
        assert status_of("fleet", "show.yaml", "-o", "out", "--report", name) == 0
    assert "energy" in capsys.readouterr().out
    page = Path("r.html").read_text()
    assert "energy [Wh]" in page
    assert "files of this kind hold none" in page
    assert re.search(r"distance to the sides of the room</td><td>(3\.9|4\.0)\d+ m at least", page)
    assert re.search(r"distance to its ceiling</td><td>20\.\d+ m at least", page)
    assert "<thead>" in page
    pdf = Path("r.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    assert pages_of(pdf) >= 2
    assert status_of("fleet", "show.yaml", "-o", "out", "--report", "r.pdf") == 0
    assert Path("r.pdf").read_bytes() == pdf


def test_another_ending_is_refused_before_anything_is_planned(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("show.yaml").write_text(SHOW)
    assert status_of("fleet", "show.yaml", "-o", "out", "--report", "r.doc") == 2
    assert "r.doc does not end in .html or .pdf" in capsys.readouterr().err
    assert not Path("out").exists()


def test_a_long_table_has_its_head_on_every_page(tmp_path, monkeypatch):
    from minsnap.plot import pdf_pages

    heads = []
    monkeypatch.setattr(pdf_pages._Book, "_head", lambda book, *_: heads.append(len(book.pages)))
    rows = [(f"vehicle {i}", f"{i}") for i in range(200)]
    parts = [
        Verdict(True, "Holds", "all of it"),
        Table("Vehicles", ["name", "number"], rows),
        Note("a " * 400),
        Signature(),
    ]
    write_parts(tmp_path / "p.pdf", "many", parts)
    assert heads == sorted(set(heads))
    assert pages_of((tmp_path / "p.pdf").read_bytes()) == heads[-1] >= 3


def test_the_power_in_hover_is_that_of_momentum_theory():
    model = PowerModel(1.2, 0.12, rotors=6, efficiency=0.6)
    induced = np.sqrt(1.2 * GRAVITY / (2.0 * AIR * 6 * np.pi * 0.12**2))  # speed of the air through the disks
    assert model.hover == pytest.approx(1.2 * GRAVITY * induced / 0.6)


def test_energy_is_the_power_over_the_time_in_which_a_vehicle_moves():
    model = PowerModel(1.0, 0.1)
    climb = minsnap.plan([(0, 0, 0), (0, 0, 20)], total_time=40.0)
    rest = minsnap.Trajectory(np.zeros((1, 8, 3)), [40.0])
    waits = minsnap.Trajectory(
        np.concatenate([np.zeros((1, 8, 3)), climb.control_points]), np.concatenate([[25.0], climb.durations])
    )
    energies = model.energies(minsnap.Fleet((climb, rest, waits)))
    t = np.linspace(0.0, 40.0, 20001)
    assert energies[0] == pytest.approx(np.trapezoid(model.power(climb(t, 2)), t) / 3600.0, rel=1e-4)
    assert energies[1] == 0.0
    assert energies[2] == pytest.approx(energies[0], rel=1e-6)


@pytest.mark.parametrize(("given", "said"), [
    ("{mass: 0, rotor_radius: 0.1}", "the mass of the energy is 0"),
    ("{mass: 1, rotor_radius: 0.1, efficiency: 1.5}", "efficiency of the energy is 1.5"),
    ("{mass: 1}", "rotor_radius"),
])  # fmt: skip
def test_an_energy_that_is_none_is_one_sentence(tmp_path, given, said):
    file = tmp_path / "show.yaml"
    file.write_text(SHOW.replace("{mass: 0.9, rotor_radius: 0.09, battery: 38}", given))
    with pytest.raises(minsnap.errors.MinsnapError, match=said):
        read_show(file)


def test_lights_are_drawn_as_lamps_show_them():
    """A row for each vehicle: its colour at every instant, dark where it has no lamp."""
    red, blue = (255.0, 0.0, 0.0), (0.0, 0.0, 255.0)
    lamp = Lights(np.array([0.0, 4.0, 8.0]), np.array([red, blue, red]), np.array([False, False, True]))
    (axes,) = light_figure([lamp, None], 10.0, [(4.0, "one"), (4.1, "two"), (8.0, "three")]).axes
    (image,) = axes.images
    colours, (left, right, low, high) = np.asarray(image.get_array()), image.get_extent()
    assert (left, right, low, high) == (0.0, 10.0, 1.5, -0.5)
    t = (np.arange(colours.shape[1]) + 0.5) * 10.0 / colours.shape[1]
    assert np.abs(colours[0] - lamp(t)).max() <= 0.5 and not colours[1].any()
    assert [text.get_text() for text in axes.texts] == ["one, two", "three"]


@pytest.mark.slow
def test_a_report_shows_lights_and_the_fence(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fence = "fence: {polygon: [[-9, -9], [9, -9], [9, 9], [-9, 9]], margin: [1, 2, 0, 3]}\n"
    Path("show.yaml").write_text(fence + SHOW.replace("hold: 1", "hold: 1, colour: red"))
    drawn = []
    monkeypatch.setattr("minsnap.shows.safety_report.write_parts", lambda path, title, parts, **_: drawn.extend(parts))
    assert status_of("fleet", "show.yaml", "-o", "out", "--to", "skyb", "--report", "r.html") == 0
    above, lights, acts = (part.figure for part in drawn if isinstance(part, Drawing))
    walls = {line.get_label(): line.get_xydata() for line in above.axes[0].lines}
    assert walls["fence"] == pytest.approx(np.array([[-9, -9], [9, -9], [9, 9], [-9, 9], [-9, -9]]))
    assert sorted(map(tuple, walls["margin"][:4].round(9))) == [(-6, -8), (-6, 9), (7, -8), (7, 9)]
    image = np.asarray(lights.axes[0].images[0].get_array())
    assert (image[:, len(image[0]) // 2] == (255, 0, 0)).all(), "by the files"
    assert [axes.get_title() for axes in acts.axes][0].startswith("ring, ")
    assert not any(isinstance(part, Table) and "beyond the list" in str(part.rows) for part in drawn)
