"""The page of derivatives: complete, escaped, the same whenever it is written, and plain about what is assumed or undefined."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import parse

import numpy as np
import pytest
from matplotlib.figure import Figure

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import STEADY, Derivatives, Static
from levelone.aerodynamics.geometry import Geometry, refined
from levelone.aerodynamics.history import FinalWake
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.modes import LATERAL, LONGITUDINAL
from levelone.aerodynamics.motion import oscillation
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particles import Particles
from levelone.aerodynamics.unsteady import Wake, simulate
from levelone.aerodynamics.wake_panels import Panels, edges
from levelone.config.geometry_file import load_geometry
from levelone.errors import InputError
from levelone.report import derivatives_figures as figures
from levelone.report import derivatives_labels as labels
from levelone.report import style, wake_figures
from levelone.report.derivatives import PRINTED, render_derivatives
from levelone.report.derivatives_record import Record
from levelone.report.derivatives_tables import off, rounded

HOSTILE = "<script>alert('x')</script> & $\\frac{1}{ {{ 7 * 7 }}"
K = np.array([0.1, 0.2])


def wing(name: str = "reference-wing-tail") -> Geometry:
    return refined(load_geometry(name), 0.25, 0.25)


def dynamic(motions: tuple[str, ...] = LONGITUDINAL) -> Derivatives:
    """Numbers that tell their place: motion, then k, then coefficient; drag zero, as without load at rest."""
    shape = (len(motions), len(K), len(NAMES))
    value = np.arange(1.0, 1.0 + math.prod(shape)).reshape(shape)
    value[..., NAMES.index("C_D")] = 0.0
    bar = np.full(shape, 0.25)
    return Derivatives(motions, K, NAMES, value, -10.0 * value, bar, 2.0 * bar, 1.01 * value, -10.2 * value)


def static() -> Static:
    value = np.arange(1.0, 31.0).reshape(5, 6)
    return Static(
        STEADY, NAMES, value, np.full((5, 6), 0.02), 1.1 * value, 0.1 * np.arange(1.0, 7.0), np.full(6, 0.001), np.full(6, 0.12)
    )


def rendered(folder: Path, **other: object) -> str:
    given = {"geometry": wing(), "derivatives": dynamic(), "static": static()} | other
    path = render_derivatives(folder, **given)
    assert path == folder / "derivatives.html"
    return path.read_text(encoding="utf-8")


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<style>.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL))


def drawn(page: str) -> list[str]:
    return re.findall(r'<figure id="([a-z_]*)"', page)


@pytest.fixture(scope="module")
def record() -> Record:
    geometry = wing("reference-evtol")
    speed, k, amplitude = 6.0, 0.2, math.radians(2.0)
    omega = 2.0 * k * speed / geometry.chord
    motion = oscillation("pitch", amplitude, omega, speed, geometry.reference_point)
    step = 2.0 * math.pi / omega / 32
    history = simulate(build(geometry), motion, speed, step, 72, wake=Wake("free", cut=6.0, core=0.5))
    return Record(history, k, omega, amplitude)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder and page of a geometry without load at rest."""
    folder = tmp_path_factory.mktemp("plain")
    return folder, rendered(folder, speeds=(6.0,))


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory, record: Record) -> tuple[Path, str]:
    """Folder and page with everything that there can be."""
    folder = tmp_path_factory.mktemp("full")
    return folder, rendered(folder, geometry=wing("reference-evtol"), derivatives=dynamic(LONGITUDINAL + LATERAL), record=record)


def test_the_page_says_what_was_found(plain):
    folder, page = plain
    text = text_of(page)
    for words in (
        "8 values of the geometry are assumed",
        "not printed; span times chord of the wing",
        "area 0.78 m², length 0.26 m, span 3 m",
        "All 108 values are defined",
        "at rest in the stream 0.1000 ± 0.0010 20 %",  # C_L0: value, bar, and the ordinary grid
        "incidence, per rad 1.000 ± 0.020 10 %",
        "1.00 ± 0.25 −10.00 ± 0.50 −2 %",  # first motion and k: in phase, quadrature, own grid
        "0.735",  # Hz of k = 0.1 at 6 m/s on a chord of 0.26 m
        "Grids of 0.5, 1, 1.5 times the geometry’s own panels",
        "Without columns, being zero at every k",
        "Diamonds: the values that the study prints",
    ):
        assert words in text, words
    assert "nan" not in text.lower().split()
    assert drawn(page) == ["dynamic_longitudinal", "loops", "theodorsen", "load", "span_load"]
    for name in drawn(page):
        assert (folder / "figures" / f"{name}.png").stat().st_size > 5000
    assert "http" not in re.sub(r'xmlns="[^"]*"', "", page)


def test_figures_are_numbered_as_they_stand(full):
    _, page = full
    numbers = [int(each) for each in re.findall(r"<b>Figure (\d+)\.</b>", page)]
    assert numbers == list(range(1, 8))
    assert drawn(page)[3:5] == ["dynamic_lateral", "wake"]


def test_the_time_domain_stands_beside(full, record):
    folder, page = full
    text = text_of(page)
    assert "Pitch oscillation of 2 deg at k = 0.2, marched in time on the geometry’s own grid: ok." in text
    assert "Left out, being steep: end plate" in text
    counts = {}
    for name in ("lattice", "wake", "body", "particles"):
        (piece,) = parse(folder / "paraview" / f"{name}.vtp").getroot().findall("PolyData/Piece")
        counts[name] = {key: int(value) for key, value in piece.attrib.items()}
        values = " ".join(array.text or "" for array in piece.iter("DataArray")).split()
        assert np.isfinite(np.array(values, dtype=float)).all()
    lattice = build(wing("reference-evtol"))
    assert counts["lattice"]["NumberOfPolys"] == counts["body"]["NumberOfPolys"] == len(lattice.bound)
    wake = record.history.wake
    assert counts["wake"]["NumberOfPolys"] == wake.panels.rows * len(lattice.first)
    assert counts["particles"]["NumberOfPoints"] == 2 * len(wake.particles.position) > 0


def test_a_failed_run_is_told_and_not_drawn(tmp_path, record):
    lost = np.full_like(record.history.by_surface, np.nan)
    history = replace(record.history, by_surface=lost, outcome=Outcome.WAKE_FULL, words=Outcome.WAKE_FULL.text, wake=None)
    page = rendered(tmp_path, geometry=wing("reference-evtol"), record=replace(record, history=history))
    text = text_of(page)
    assert "wake capacity exceeded" in text
    assert "undefined undefined the record holds values that are not finite" in text
    assert "wake" not in drawn(page)
    assert not (tmp_path / "paraview" / "particles.vtp").exists()


def test_undefined_values_are_counted_and_named(tmp_path):
    found = dynamic()
    found.quadrature[0, 0, :] = math.nan
    found.quadrature_error[0, 0, :] = math.nan
    text = text_of(rendered(tmp_path, derivatives=found))
    assert "6 of 108 values of this page are undefined" in text
    assert "1.00 ± 0.25 undefined undefined undefined" in text


def test_figures_without_a_defined_value_can_be_drawn(paper):
    shown = dynamic()
    lost = {name: np.full_like(shown.in_phase, np.nan) for name in ("in_phase", "quadrature", "in_phase_error", "quadrature_error")}
    found = replace(shown, **lost)
    loops = [figures.harmonic_loop(found, 0, 0.03, {"C_L": 0.1, "C_m": 0.0})]
    for figure in (figures.draw_dynamic(found, LONGITUDINAL, ("C_L", "C_m"), None), figures.draw_loops(loops, ("C_L", "C_m"))):
        assert len(style.png_of(figure)) > 5000
    assert "= undefined" in loops_text(figure)


def loops_text(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.axes[0].texts)


def test_the_same_results_give_the_same_bytes(plain, tmp_path):
    first, page = plain
    assert rendered(tmp_path, speeds=(6.0,)) == page
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert len(files) == 1 + 2 * 5 + 1
    for name in files:
        assert (tmp_path / name).read_bytes() == (first / name).read_bytes()


def test_what_a_file_says_is_shown_as_text(tmp_path):
    given = wing()
    surfaces = tuple(replace(each, name=f"_{HOSTILE} {index}") for index, each in enumerate(given.surfaces))
    hostile = replace(given, name=HOSTILE, description=HOSTILE, surfaces=surfaces, assumed=((HOSTILE, HOSTILE),))
    page = rendered(tmp_path, geometry=hostile, derivatives=dynamic(LATERAL))
    assert "<script>" not in page
    assert page.count("&lt;script&gt;") >= 6
    assert "49" not in page[page.index("<h1>") : page.index("</h1>")]
    # lateral motions alone have a page of their own as well
    assert drawn(page) == ["dynamic_lateral", "load", "span_load"]
    for words in ("ωb/(2V)", "Sideslip oscillation", "Roll oscillation", "Yaw oscillation", "Pure yaw rate"):
        assert words in text_of(page), words


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        rendered(tmp_path / "file")


@pytest.mark.paper
def test_the_printed_values_are_those_of_the_study():
    path = Path(__file__).parents[1] / "reference" / "aerodynamics.toml"
    study = tomllib.loads(path.read_text(encoding="utf-8"))["study"]
    printed = PRINTED["reference-wing-tail"]
    assert list(printed.quadrature["C_L"]) == study["lift_pitch"]
    assert list(printed.quadrature["C_m"]) == study["moment_pitch"]
    assert printed.earlier == {"C_m": study["C_mq_lifting_surface"]}


def test_the_thickness_of_the_loop_is_the_derivative():
    found, amplitude = dynamic(), 0.03
    loop = figures.harmonic_loop(found, 1, amplitude, {"C_m": 0.5})
    values = loop.coefficients["C_m"]
    column = NAMES.index("C_m")
    assert values[0] - values[90] == pytest.approx(2.0 * amplitude * K[1] * found.quadrature[0, 1, column], rel=1e-12)
    assert values[45] - values[135] == pytest.approx(2.0 * amplitude * found.in_phase[0, 1, column], rel=1e-12)
    assert values[[45, 135]].mean() == pytest.approx(0.5, rel=1e-12)
    assert loop.theta[45] == pytest.approx(amplitude, rel=1e-12)


def test_attitude_of_a_record_is_that_of_its_motion(record):
    expected = record.amplitude * np.sin(record.omega * record.history.time)
    np.testing.assert_allclose(record.theta, expected, atol=1e-12)


def test_the_error_bars_are_drawn_where_they_belong(paper):
    figure = figures.draw_dynamic(dynamic(), LONGITUDINAL, ("C_L", "C_m"), PRINTED["reference-wing-tail"])
    (lines, _, (bars,)) = figure.axes[0].containers[0]
    np.testing.assert_allclose(lines.get_ydata(), dynamic().quadrature[0, :, 0])
    for segment, value in zip(bars.get_segments(), dynamic().quadrature[0, :, 0], strict=True):
        np.testing.assert_allclose(segment[:, 1], [value - 0.5, value + 0.5])


def test_thin_aerofoil_curves_are_those_of_the_closed_form(paper):
    figure = figures.draw_theodorsen(np.array([0.05, 0.1, 0.5]))
    lift, moment = ([line.get_ydata() for line in axes.lines[:2]] for axes in figure.axes)
    np.testing.assert_allclose(lift, [[-7.56419, -2.45734, 5.00466], [-13.27567, -7.68448, 1.24772]], atol=2e-4)
    np.testing.assert_allclose(moment, [[-math.pi / 2] * 3, [-math.pi / 4] * 3], rtol=1e-9)


def test_both_halves_of_a_wake_are_drawn_once():
    ends = np.array([[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], [[1.0, 1.0, 0.0], [1.0, 2.0, 0.0]]])
    line = edges(ends)
    nodes = np.stack([line.joined(ends + np.array([x, 0.0, 0.0])) for x in (0.0, 0.5)])
    panels = Panels(line, nodes, np.array([[3.0, 2.0]]), np.zeros(2))
    strength = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    particles = Particles(np.array([[2.0, 0.0, 0.0], [2.0, 0.7, 0.1]]), strength, np.full(2, 0.1))
    body = np.array([[[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 0.0, 0.0]]])
    found = wake_figures.wake_arrays(FinalWake(panels, particles, True, body))
    np.testing.assert_array_equal(found.panels[0], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.5, 0.0, 0.0]])
    np.testing.assert_array_equal(found.panels[2], [[1.0, -1.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [1.5, -1.0, 0.0]])
    np.testing.assert_array_equal(found.circulation, [3.0, 2.0, 3.0, 2.0])
    np.testing.assert_array_equal(found.body[1], [[0.0, -2.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, -2.0, 0.0]])
    # what lies in the plane of symmetry and turns its sign in the mirror is not there
    np.testing.assert_array_equal(found.strength[[0, 2]], [[0.0, 2.0, 0.0], [0.0, 2.0, 0.0]])
    np.testing.assert_array_equal(found.strength[[1, 3]], [[4.0, 5.0, 6.0], [-4.0, 5.0, -6.0]])
    np.testing.assert_array_equal(found.position[3], [2.0, -0.7, 0.1])


@pytest.mark.parametrize("particles", [0, 5])
def test_a_wake_without_panels_or_particles_can_be_drawn(paper, particles):
    body, none = np.array([[[0.0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]]]), np.empty((0, 4, 3))
    position = np.linspace(0.0, 1.0, 3 * particles).reshape(-1, 3)
    wake = wake_figures.WakeArrays(body, none, np.empty(0), position, np.ones((particles, 3)), np.ones(particles))
    assert len(style.png_of(wake_figures.draw_wake(wake))) > 2000


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (9.5223, 0.0111, ("9.522", "± 0.011")),
        (-18.26, 0.13, ("−18.26", "± 0.13")),
        (-0.0001, 0.05, ("0.000", "± 0.050")),
        (-1.5143e-5, 1.6e-6, ("−1.51·10⁻⁵", "± 1.6·10⁻⁶")),
        (1234.5, 250.0, ("1.23·10³", "± 2.5·10²")),
        (5.0, 0.0, ("5", "± 0")),
        (math.nan, math.nan, ("undefined", "undefined")),
        (2.0, math.nan, ("2", "undefined")),
    ],
)
def test_values_are_rounded_to_their_bars(value, error, shown):
    assert rounded(value, error) == shown


def test_how_far_the_ordinary_grid_is_off():
    assert off(-20.0, 0.1, -19.0) == "5 %"
    assert off(0.01, 0.02, 0.03) == "0.02"
    assert off(1.0, 0.1, math.nan) == "undefined"
    assert off(0.0, 0.0, -0.0) == "0"


@pytest.mark.parametrize(
    ("motion", "coefficient", "text"),
    [
        ("pitch", "C_m", r"$C_{mq}$ + $C_{m\dot{\alpha}}$"),
        ("heave", "C_L", r"$C_{L\dot{\alpha}}$"),
        ("yaw", "C_n", r"$C_{nr}$ − $C_{n\dot{\beta}}$"),
        ("roll", "C_l", "$C_{lp}$"),
    ],
)
def test_derivatives_have_the_names_of_the_field(motion, coefficient, text):
    assert labels.quadrature(motion, coefficient) == text


@pytest.mark.parametrize("name", ["k", "omega", "amplitude"])
def test_a_record_needs_positive_numbers(record, name):
    with pytest.raises(InputError, match=f"{name}: -1"):
        replace(record, **{name: -1.0})
