from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.config.other_codes import read_loads, read_st, read_stab, read_stab_conditions
from levelone.config.other_codes.other_code import NAMES
from levelone.errors import InputError
from levelone.vehicle.vehicle import LATERAL

REFERENCE = Path(__file__).parents[1] / "reference"
LOADS = REFERENCE / "dust" / "integral_loads_total.dat"
ST, STAB, STABS = (REFERENCE / "other-codes" / name for name in ("swept-wing.st", "one-condition.stab", "two-conditions.stab"))
BODY_AXES = tomllib.loads((REFERENCE / "other-codes" / "swept-wing.toml").read_text(encoding="utf-8"))


@pytest.fixture
def edited(tmp_path):
    """A copy of a file with one text replaced, which must occur."""

    def _edited(path, old, new, count=1):
        text = path.read_text(encoding="utf-8")
        assert old in text
        copy = tmp_path / path.name
        copy.write_text(text.replace(old, new, count), encoding="utf-8")
        return copy

    return _edited


def refused(reader, path):
    with pytest.raises(InputError) as caught:
        reader(path)
    text = str(caught.value)
    assert text.startswith(f"{path.name}: ")
    assert "\n" not in text
    return text


def test_dust_loads_come_with_their_components_and_axes():
    loads = read_loads(LOADS)
    raw = np.loadtxt(LOADS, comments="#")
    np.testing.assert_array_equal(loads.time, raw[:, 0])
    np.testing.assert_array_equal(np.hstack([loads.force, loads.moment, loads.rotation, loads.offset]), raw[:, 1:])
    assert loads.components == ("wing", "tail")
    assert loads.system == "0"
    assert loads.fixed


def test_dust_loads_of_the_parts_are_those_of_the_whole():
    wing, tail, total = (read_loads(LOADS.with_name(f"integral_loads_{name}.dat")) for name in ("wing", "tail", "total"))
    assert wing.components + tail.components == total.components
    np.testing.assert_allclose(wing.force + tail.force, total.force, atol=1e-12)
    np.testing.assert_allclose(wing.moment + tail.moment, total.moment, atol=1e-12)


@pytest.mark.oracle
def test_dust_loads_give_the_derivatives_of_the_motion():
    loads = read_loads(LOADS)
    force = 0.5 * 1.225 * 6.0**2 * 3.0 * 0.26
    for value, expected in ((loads.force[:, 2] / force, 11.03), (loads.moment[:, 1] / (force * 0.26), -25.93)):
        found = derivative(harmonic(loads.time, value, 9.230769), math.radians(2.0), 0.2)
        assert found.quadrature == pytest.approx(expected, rel=0.005)


def test_a_system_that_turns_with_the_body_is_told(edited):
    turned = edited(LOADS, "0.100000000000000E+001", "0.990000000000000E+000")
    assert not read_loads(turned).fixed


DUST_FAULTS = [
    ("Integral loads", "Hinge Moment", "line 1 must hold 'Integral loads: N.components:': this is no file"),
    ("N.components: 2", "N.components: two", "line 1: the number of components must be a number, got 'two'"),
    ("N.components: 2", "N.components: 3", "line 3 names 2 components (wing, tail), line 1 says 3"),
    ("Ref.sys     : 0", "Ref.sys     :", "line 2 must hold '# Ref.sys : ...'"),
    ("Components  :", "Parts  :", "line 3 must hold '# Components : ...'"),
    ("t , Fx , Fy", "Fx_average , Fy_average", "line 4: holds averages, expected a history"),
    (
        "Fx , Fy , Fz",
        "Fx , Fz , Fy",
        "line 4 must name the columns t, Fx, Fy, Fz, Mx, My, Mz, ref_mat(9), ref_off(3); got t, Fx, Fz, Fy",
    ),
    ("0.165620109433492E+001", "", "line 5 has 18 numbers, expected 19"),
    ("0.165620109433492E+001", "**********************", "line 5: every cell must be a number, got '****"),
    ("0.165620109433492E+001", "NaN", "line 5: every cell must be a finite number, got 'NaN'"),
    ("0.108044191790100E-001", "-.108044191790100E-001", "line 6: times must increase, got -0.0108044 s after 0 s"),
]


@pytest.mark.parametrize(("old", "new", "problem"), DUST_FAULTS)
def test_broken_dust_loads_are_refused_with_their_line(edited, old, new, problem):
    assert problem in refused(read_loads, edited(LOADS, old, new))


def test_dust_loads_without_a_line_of_numbers_are_refused(tmp_path):
    path = tmp_path / "loads.dat"
    path.write_text("\n".join(LOADS.read_text().splitlines()[:4]) + "\n")
    assert "holds no loads: expected lines of 19 numbers" in refused(read_loads, path)


@pytest.mark.oracle
@pytest.mark.parametrize("name", sorted(BODY_AXES["derivatives"]))
def test_avl_stability_axes_become_the_body_axes_that_avl_prints(name):
    # six decimals of the derivatives, five of the moments that enter those with alpha
    assert read_st(ST).derivatives[name] == pytest.approx(BODY_AXES["derivatives"][name], abs=8e-6 if "alpha" in name else 2e-6)


@pytest.mark.oracle
def test_avl_condition_totals_and_reference_values():
    found = read_st(ST)
    assert dict(found.coefficients) == pytest.approx(BODY_AXES["coefficients"], abs=5.1e-6)
    assert (found.alpha, found.beta) == pytest.approx((math.radians(8), math.radians(3)))
    assert (found.area, found.chord, found.span, found.reference_point) == (2.0, 0.5, 4.0, (0.3, 0.0, 0.05))
    assert math.isnan(found.airspeed)


def test_what_an_older_avl_does_not_print_is_nan_and_said(edited):
    found = read_st(ST)
    assert [name for name in NAMES if math.isnan(found.derivatives[name])] == [name for name in NAMES if name.startswith("C_D")]
    assert "C_Dalpha, C_Dbeta, C_Dp, C_Dq, C_Dr" in dict(found.not_converted)
    rows = (
        " x' force CD |    CDa =   0.301002    CDb =  -0.016004\n",
        " x' force CD |    CDp =   0.1    CDq =   0.215195    CDr =   0.2\n",
    )
    newer = read_st(edited(ST, " y  mom.  Cm |", rows[0] + rows[1] + " y  mom.  Cm |"))
    assert newer.derivatives["C_Dq"] == 0.215195
    assert newer.derivatives["C_Dr"] == pytest.approx(0.2 * math.cos(newer.alpha) + 0.1 * math.sin(newer.alpha))
    assert "C_Dalpha, C_Dbeta, C_Dp, C_Dq, C_Dr" not in dict(newer.not_converted)


@pytest.mark.oracle
def test_the_geometric_orientation_of_avl_gives_the_same(tmp_path):
    """AVL multiplies Cl, Cn, p and r by -1 in place of 1 there (its DIR), wherever they are printed."""
    lines = (
        ST.read_text()
        .replace("Standard axis orientation,  X fwd, Z down ", "Geometric axis orientation,  X aft, Z up  ")
        .splitlines()
    )

    def flip(line, names):
        for name in names:
            before, after = line.split(f"{name} =", 1)
            line = f"{before}{name} ={-float(after[:11]):11.6f}{after[11:]}"
        return line

    for i, line in enumerate(lines):
        if "mom.  C" in line and "d1" not in line:
            roll_or_yaw = "Cm |" not in line
            prefix = {"x": "Cl", "y": "Cm", "z": "Cn"}[line.strip()[0]]
        elif "force C" in line and "d1" not in line:
            roll_or_yaw, prefix = False, line.split("force ")[1][:2]
        else:
            continue
        variables = [v for v in "abpqr" if f"{prefix}{v} =" in line and roll_or_yaw != (v in "pr")]
        lines[i] = flip(line, [prefix + v for v in variables])
    text = "\n".join(lines)
    for name in ("Cltot", "Cntot", "Cl'tot", "Cn'tot"):
        before, after = text.split(f" {name} =", 1)
        text = f"{before} {name} ={-float(after[:10]):10.5f}{after[10:]}"
    path = tmp_path / "geometric.st"
    path.write_text(text + "\n")
    geometric, standard = read_st(path), read_st(ST)
    assert dict(geometric.derivatives) == pytest.approx(dict(standard.derivatives), abs=1e-12, nan_ok=True)
    assert dict(geometric.coefficients) == pytest.approx(dict(standard.coefficients), abs=1e-12)


def test_the_spiral_ratio_is_not_taken_for_a_derivative(edited):
    path = edited(ST, "Clb Cnr / Clr Cnb  =   0.756682", "Clb Cnr / Clr Cnb  =  99.000000")
    assert dict(read_st(path).derivatives) == pytest.approx(dict(read_st(ST).derivatives), nan_ok=True)


AVL_FAULTS = [
    (
        "Stability-axis derivatives",
        "Geometry-axis derivatives",
        "holds 'Geometry-axis derivatives' (command sb), expected 'Stability-axis",
    ),
    ("Stability-axis derivatives", "Hinge moments", "this is no file of AVL's command st"),
    ("Standard axis orientation", "Wind axis orientation", "expected a line with 'Standard axis orientation' or 'Geometric axis"),
    ("Cmq =", "Cmx =", "line 34: expected the value of Cmq in the derivatives that start here"),
    ("Cmq =  -1.613181", "Cmq =***********", "line 49: Cmq must be a number, got '***********'"),
    ("Cmq =  -1.613181", "Cmq =        NaN", "line 49: Cmq must be a finite number, got 'NaN'"),
    ("Cmr =", "Cmq =", "line 49: Cmq is given twice"),
    ("Sref =  2.0000", "Sref =  0.0000", "Sref must be positive, got 0"),
    ("Bref =", "Bspan=", "line 34: expected the value of Bref above the derivatives"),
    ("pb/2V =  -0.00000     p'b", "pb/2V =   0.02000     p'b", "pb/2V is 0.02, expected 0: AVL holds stability-axis rates"),
]


@pytest.mark.parametrize(("old", "new", "problem"), AVL_FAULTS)
def test_a_broken_avl_file_is_refused_with_its_line(edited, old, new, problem):
    assert problem in refused(read_st, edited(ST, old, new))


def test_two_runs_in_one_avl_file_are_refused(tmp_path):
    (path := tmp_path / "two.st").write_text(ST.read_text() * 2)
    assert "expected one run, here 'Stability-axis derivatives' stands again" in refused(read_st, path)


def test_vspaero_derivatives_have_our_names_and_signs():
    """The values are those that the sample was made of."""
    found = read_stab(STAB)
    assert dict(found.coefficients) == {"C_L": 0.31, "C_D": 0.0121, "C_Y": -0.002, "C_l": 0.0007, "C_m": -0.041, "C_n": 0.0003}
    expected = {
        "C_Lalpha": 5.1132, "C_Lq": 7.6124, "C_Dalpha": 0.1932, "C_Dq": 0.2211, "C_malpha": -0.5402, "C_mq": -16.1691,
        "C_Ybeta": -0.2345, "C_Yp": -0.0456, "C_Yr": 0.1789, "C_lbeta": -0.0678, "C_lp": -0.5123, "C_lr": 0.0987,
        "C_nbeta": 0.0345, "C_np": -0.0321, "C_nr": -0.0876, "C_Lbeta": -0.0113, "C_nalpha": 0.0004,
    }  # fmt: skip
    assert {name: found.derivatives[name] for name in expected} == expected
    assert set(found.derivatives) == set(NAMES)


def test_vspaero_condition_and_reference_values():
    found = read_stab(STAB)
    assert (found.alpha, found.beta, found.mach, found.airspeed) == pytest.approx((math.radians(2), 0.0, 0.0176, 6.0))
    assert (found.area, found.chord, found.span, found.reference_point) == (0.78, 0.26, 3.0, (0.065, 0.0, 0.0))
    assert "control group Elevator" in dict(found.not_converted)


def test_every_condition_of_a_vspaero_file_is_read():
    first, second = read_stab_conditions(STABS)
    assert (first.alpha, second.alpha) == pytest.approx((0.0, math.radians(2)))
    assert first.coefficients["C_L"] == 0.13
    assert first.derivatives["C_Lq"] == pytest.approx(7.6124 - 0.018)
    assert dict(second.derivatives) == dict(read_stab(STAB).derivatives)
    text = refused(read_stab, STABS)
    assert "holds 2 conditions (alpha 0 deg, beta 0 deg, alpha 2 deg, beta 0 deg), expected one: use read_stab_conditions" in text


#: start of the row of derivatives of the pitching moment
MOMENT = "CMm      -0.0410000"

STAB_FAULTS = [
    ("Sref_", "Xref_", "expected Sref_ first, got 'Xref_"),
    ("Vinf_  ", "Vrel_  ", "line 4: expected the value of Vinf_ in the table that starts here"),
    ("Vinf_                   6.0000000", "Vinf_                   0.0000000", "Vinf_ must be positive, got 0"),
    ("Cref_                   0.2600000", "Cref_                   0.26m", "line 5: Cref_ must be a number, got '0.26m'"),
    ("Pitch_Rate             +", "Pitch rate 2           ", "expected a case, its step (+1.000), unit and coefficients"),
    ("Pitch_Rate             +", "Surge_Rate             +", "line 4: expected the case Pitch_Rate with CL: without it"),
    (MOMENT, MOMENT.replace("-0.0410000", "      -nan"), "line 50: CMm Total must be a finite number, got '-nan'"),
    (MOMENT, "CMm", "line 50: CMm has 8 values, expected 9: Total, Alpha, Beta"),
    (
        MOMENT,
        MOMENT.replace("CMm", "CMt"),
        "line 4: the condition that starts here holds no CMm, Alpha in its table of derivatives",
    ),
    ("+1.000 rad/Tunit", "+1.000 deg/Tunit", "the step of Roll__Rate must be given in rad/Tunit and not be zero, got 1 deg/Tunit"),
]


@pytest.mark.parametrize(("old", "new", "problem"), STAB_FAULTS)
def test_a_broken_vspaero_file_is_refused_with_its_line(edited, old, new, problem):
    assert problem in refused(read_stab, edited(STAB, old, new))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        # rates by c/V in place of c/(2V): twice the derivative
        (
            "-16.1691000",
            "-32.3382000",
            "CMm per q is -32.3382, but the cases give -16.1691 per q times c/(2V): normalised otherwise",
        ),
        # per deg in place of per rad
        (
            "CL        0.3100000    5.1132000",
            "CL        0.3100000    0.0892422",
            "CL per Alpha is 0.0892422, but the cases give 5.1132 per rad: normalised otherwise",
        ),
        # another sign of the yaw rate
        ("0.0011000   -0.0876000", "0.0011000    0.0876000", "CMn per r is 0.0876, but the cases give -0.0876"),
        # another chord than the derivatives were made with
        ("Cref_                   0.2600000", "Cref_                   0.2500000", "per q is"),
    ],
)
def test_derivatives_that_do_not_follow_from_the_cases_are_refused(edited, old, new, problem):
    assert problem in refused(read_stab, edited(STAB, old, new, -1))


def test_an_empty_vspaero_file_is_refused(tmp_path):
    (path := tmp_path / "empty.stab").write_text("\n")
    assert "this is no VSPAERO .stab file" in refused(read_stab, path)


@pytest.mark.parametrize("reader", [read_loads, read_st, read_stab])
def test_missing_and_binary_files_are_refused(reader, tmp_path):
    assert "no such file" in refused(reader, tmp_path / "none.dat")
    (tmp_path / "binary.dat").write_bytes(b"\xff\xfe\x00")
    assert "is not a UTF-8 text file" in refused(reader, tmp_path / "binary.dat")


def test_lateral_coefficients_of_a_vehicle_are_among_the_names():
    assert set(LATERAL) < set(NAMES)
