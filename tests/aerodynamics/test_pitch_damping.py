"""Keeps the numbers of docs/theory/pitch-damping.md: its rows are read from the page and computed again on half as many panels."""

from __future__ import annotations

import functools
import importlib
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from levelone.aerodynamics import scan
from levelone.aerodynamics.extraction import harmonic
from levelone.aerodynamics.geometry import refined
from levelone.aerodynamics.scan import Case
from levelone.aerodynamics.slender_body import contributions
from levelone.config.other_codes.dust import read_loads

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "theory" / "pitch-damping.md").read_text()
PAPER = tomllib.loads((ROOT / "tests" / "reference" / "paper.toml").read_text())
REFERENCE = tomllib.loads((ROOT / "tests" / "reference" / "aerodynamics.toml").read_text())
RELATIVE, ABSOLUTE = 0.005, 0.02  # stated on the page, beside twice the error bar
NUMBER = r"[-+]?\d+(?:\.\d+)?"


@functools.cache
def tools() -> ModuleType:
    """Hypotheses of the page's script, which imports its neighbours by name as scripts do."""
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        return importlib.import_module("pitch_hypotheses")
    finally:
        sys.path.remove(str(ROOT / "tools"))


def rows(table: str) -> dict[str, list[str]]:
    """Cells of a table of the page by the label of their row, its head among them as ``head``."""
    block = re.search(rf"<!-- {table} -->\n((?:\|.*\n)+)", PAGE)
    assert block, table
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in block[1].splitlines()]
    return {"head": lines[0]} | {cells[0]: cells[1:] for cells in lines[2:]}


def numbers(cells: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """First number of each cell, and its error bar (0 if there is none)."""
    found = [[float(x) for x in re.findall(NUMBER, cell)] for cell in cells]
    bars = [line[1] if "±" in cell else 0.0 for line, cell in zip(found, cells, strict=True)]
    return np.array([line[0] for line in found]), np.array(bars)


def assert_kept(cells: list[str], computed: np.ndarray) -> None:
    value, bar = numbers(cells)
    computed = np.ravel(computed)
    allowed = np.maximum.reduce([RELATIVE * np.abs(value), np.full(len(value), ABSOLUTE), 2.0 * bar])
    assert np.all(np.abs(computed - value) <= allowed), (value, computed)


def coarse(geometry):
    return refined(geometry, 0.5, 0.5)


def test_tolerance_is_the_one_that_the_page_states():
    assert f"accept {RELATIVE:.1%}, {ABSOLUTE}, or twice the error bar".replace("%", " %") in " ".join(PAGE.split())


def test_steady_table():
    found = scan.quasi_steady([Case("", coarse(each)) for each in (tools().WING, tools().BOTH, tools().FULL)]).value
    page = rows("steady")
    for label, computed in zip(("wing", "wing and tail, as printed", "with incidence and end plates"), found, strict=True):
        assert_kept(page[label], computed)


def test_frequency_and_shares_tables():
    k = [0.05, 0.1, 0.2]
    found = scan.oscillations([Case("", coarse(tools().BOTH)), Case("", coarse(tools().WING))], k)
    for j, each in enumerate(k):
        both, wing = found.quadrature[:, :, j]
        assert_kept(rows("frequency")[f"{each:g}"], both)
        tail = both - wing
        chosen = [part[i] for part in (wing, tail) for i in ((0, 0), (0, 1), (1, 1), (2, 1))]
        assert_kept(rows("shares")[f"{each:g}"], np.array(chosen))


def test_arm_table():
    geometries = [tools().with_arm(arm) for arm in (0.54, 0.80)]
    found = scan.oscillations([Case("", coarse(each)) for each in geometries], tools().K, ("pitch",)).at("pitch")
    assert_kept(rows("arm")["0.54"], found[0])
    assert_kept(rows("arm")["0.80"], found[1])


def test_the_arms_that_fit_are_read_off_the_scan():
    page = rows("arm")
    labels = [label for label in page if re.fullmatch(NUMBER, label)]
    scanned = np.array([numbers(page[label])[0] for label in labels])
    for column, target in enumerate(numbers(page["study"])[0]):
        arm = scan.crossing([float(label) for label in labels], scanned[:, column], target)
        assert arm[-1] == pytest.approx(numbers(page["arm that gives it"])[0][column], abs=0.006)


def test_half_the_arm_about_the_leading_edge():
    found = scan.oscillations([Case("", coarse(tools().with_arm(0.475)))], tools().K, ("pitch", "heave")).response[0]
    about_edge = scan.transferred(found[0], found[1], tools().K, -0.25, -0.25).imag / tools().K[:, None]
    assert_kept(rows("oscillation")["CG at the leading edge, tail 0.54 m behind it"][:4], about_edge)


def test_the_centre_of_gravity_of_the_lifting_surface_set():
    aft, value = tools().centred(coarse(tools().BOTH))
    assert aft == pytest.approx(0.183, abs=0.002)
    assert_kept(rows("lifting_surface")["CG +0.183 c (fits C_malpha)"][:4], value)


@pytest.mark.paper
def test_published_numbers_are_those_of_the_study():
    factors = {each["name"]: each["value"] for each in PAPER["factor"]}
    set_1 = [factors[name] for name in scan.QUASI_STEADY]
    set_2 = [REFERENCE["study"][name][j] for j in range(2) for name in ("lift_pitch", "moment_pitch")]
    np.testing.assert_array_equal(numbers(rows("lifting_surface")["study"][:4])[0], set_1)
    np.testing.assert_array_equal(numbers(rows("oscillation")["study"][:4])[0], set_2)
    np.testing.assert_array_equal(numbers(rows("steady")["study, lifting-surface code"])[0], set_1)
    np.testing.assert_array_equal(tools().OSCILLATION.ravel(), set_2)
    np.testing.assert_array_equal(tools().LIFTING_SURFACE, set_1)


@pytest.mark.parametrize("table", ["oscillation", "lifting_surface"])
def test_verdicts_follow_from_all_numbers_of_a_row(table):
    page = rows(table)
    target = numbers(page["study"][:4])[0]
    judged = {label: cells for label, cells in page.items() if label not in ("head", "study")}
    assert len(judged) > 10
    for label, cells in judged.items():
        value = numbers(cells[:4])[0]
        residual = np.array([float(re.findall(rf"\(({NUMBER}) %\)", cell)[0]) / 100.0 for cell in cells[:4]])
        np.testing.assert_allclose(value / target - 1.0, residual, atol=0.011, err_msg=label)
        worst = np.abs(residual).max()
        expected = "matched" if worst <= 0.0504 else "near" if worst <= 0.124 else "rejected"
        assert cells[4] == expected, label


def test_no_single_reading_matches_the_oscillation_set():
    """Conclusion 4 of the page: whatever is matched or near has a shorter arm, and something beside it."""
    near = [label for label, cells in rows("oscillation").items() if cells[-1] in ("near", "matched")]
    assert len(near) == 6
    for label in near:
        assert re.search(r"arm 0\.[345]\d? m|tail 0\.54 m", label), label
        assert "CG" in label or "scheme" in label or "axis" in label, label


@pytest.mark.oracle
def test_ordinary_scheme_is_off_as_dust_is():
    """DUST with 24 rows of wake panels, wing alone, 4 x 20, k = 0.2: within 2 %; the converged lift is 43 % less."""
    page = numbers(rows("scheme")["rings on the panels' edges, 4 x 20"])[0]
    assert page[2] == pytest.approx(REFERENCE["dust"]["wing_only"]["panel_rows_24"], rel=0.02)
    wing = scan.with_uniform_strips(tools().WING, {"wing": (4, 10)})
    np.testing.assert_allclose(np.ravel([tools().unshifted_pitch(wing, k) for k in tools().K]), page, atol=0.006)


@pytest.mark.oracle
def test_dust_at_the_printed_geometry_is_far_from_the_study():
    text = " ".join(PAGE.split())
    lift, moment = (float(x) for x in re.search(rf"at the printed geometry, ({NUMBER}) and ({NUMBER}) in total", text).groups())
    loads = read_loads(ROOT / "tests" / "reference" / "dust" / "integral_loads_total.dat")
    by = 0.5 * 1.225 * 36.0 * 0.78 * np.radians(2.0) * 0.2
    omega = 9.230769
    for history, printed, scale in ((loads.force[:, 2], lift, by), (loads.moment[:, 1], moment, by * 0.26)):
        # 0.2 %: how the last period, no whole number of steps, is cut out of the record
        assert harmonic(loads.time, history, omega).quadrature / scale == pytest.approx(printed, rel=0.002)
    assert lift / 7.9898 == pytest.approx(1.38, abs=0.005)
    assert moment / -8.6516 == pytest.approx(3.0, abs=0.01)


def test_fuselage_table():
    found = contributions(tools().FUSELAGE, tools().BOTH)
    page = rows("fuselage")
    head, values = page["head"], next(cells for label, cells in page.items() if label != "head")
    first = float(next(label for label in page if label != "head"))
    np.testing.assert_allclose([first, *numbers(values)[0]], [getattr(found, name) for name in head], atol=6e-4)
