"""Readings of the reference study that could explain its pitch damping, each held against a whole set of its numbers.

Two sets: derivatives of pitch oscillations at k = 0.1 and 0.2 (from a code of vortex lattice and particles), and the steady
derivatives of an earlier lifting-surface code. docs/theory/pitch-damping.md discusses the result.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, least_squares

from levelone.aerodynamics import scan
from levelone.aerodynamics.geometry import FloatArray, Geometry, refined
from levelone.aerodynamics.scan import Case
from levelone.aerodynamics.slender_body import contributions, spheroid
from levelone.config.geometry_file import load_geometry
from unshifted_rings import pitch as unshifted_pitch

K = np.array([0.1, 0.2])
OSCILLATION = np.array([[5.9649, -6.9263], [7.9898, -8.6516]])  # [k, (C_L, C_m)], study, Tables 3 to 5
LIFTING_SURFACE = np.array([5.1270, -0.5402, 7.6136, -16.169])  # C_Lalpha, C_malpha, C_Lq, C_mq, study, Table 2
MATCH, NEAR = 0.05, 0.12  # largest relative residual of a set that is matched, or nearly
ARM = 1.08
ARMS = np.array([0.30, 0.35, 0.40, 0.45, 0.50, 0.54, 0.60, 0.70, 0.80, 0.90, 1.00, ARM])
FUSELAGE = spheroid((-0.45, 0.0, 0.0), 1.65, 0.16)  # assumed: length, width and place are not printed
FINER = 1.5  # end plates converge more slowly: their grids have that many times the panels along chord and span
UNIFORM = {"wing": (12, 30), "tail": (8, 10)}  # panels of the codes that were compared

WING, BOTH = load_geometry("reference-wing"), load_geometry("reference-wing-tail")
FULL = refined(load_geometry("reference-evtol"), FINER, FINER)


def with_arm(arm: float, geometry: Geometry = BOTH) -> Geometry:
    """The tail, and what stands on it, at another arm between quarter chords, m."""
    return scan.moved(geometry, [each.name for each in geometry.surfaces if each.name != "wing"], aft=arm - ARM)


def verdict(residual: FloatArray) -> str:
    worst = np.abs(residual).max()
    return "matched" if worst <= MATCH else "near" if worst <= NEAR else "rejected"


class Arms:
    """Responses for a scan of the tail arm, and interpolated between: pitch and heave about the wing's quarter chord."""

    def __init__(self) -> None:
        self.found = scan.oscillations([Case(f"{arm:g}", with_arm(arm)) for arm in ARMS], K, ("pitch", "heave"))
        self.parts = CubicSpline(ARMS, self.found.response.real), CubicSpline(ARMS, self.found.response.imag)

    def at(self, arm: float, axis: float = 0.0, moment: float = 0.0) -> FloatArray:
        """Quadrature over k [k, 2] of pitch about an axis, with moments about a point, both in chords aft of the quarter chord."""
        pitch, heave = self.parts[0](arm) + 1j * self.parts[1](arm)
        return np.asarray(scan.transferred(pitch, heave, K, axis, moment).imag / K[:, None])

    def fitted(self, j: int, coefficient: int) -> float:
        """Arm that gives one number of the study."""
        values = self.found.at("pitch")[:, j, coefficient]
        return float(scan.crossing(ARMS, values, OSCILLATION[j, coefficient])[-1])


def fit(model: Callable[[FloatArray], FloatArray], start: list[float], target: FloatArray) -> FloatArray:
    """Parameters with the least sum of squares of relative residuals; the first of several is an arm within the scan."""
    low, high = np.full(len(start), -6.0), np.full(len(start), 6.0)
    if len(start) > 1:
        low[0], high[0] = ARMS[0], ARMS[-1]
    return np.asarray(least_squares(lambda x: (model(x) / target - 1.0).ravel(), start, bounds=(low, high)).x)


def scheme_error(arm: float, chordwise: int) -> FloatArray:
    """[k, 2] what an ordinary scheme adds on wing and tail, each by itself."""
    total = np.zeros((2, 2))
    for name, panels in (("wing", (chordwise, 10)), ("tail", (chordwise // 2, 8))):
        alone = scan.only(with_arm(arm), name)
        ordinary = scan.with_uniform_strips(alone, {name: panels})
        total += np.array([unshifted_pitch(ordinary, k) for k in K])
        total -= scan.oscillations([Case(name, alone)], K, ("pitch",)).at("pitch")[0]
    return total


def readings() -> dict[str, FloatArray]:
    """Other readings of formula and units, at the printed geometry: [k, (C_L, C_m)] by label."""
    found = scan.oscillations([Case("", BOTH)], [0.05, 0.1, 0.2], ("pitch", "heave", "rate"))
    slow, printed = found.at("pitch")[0, :2], found.at("pitch")[0, 1:]
    factor = fit(lambda x: printed * [1.0, x[0]], [1.0], OSCILLATION)[0]
    return {
        "printed geometry": printed,
        "pure pitch rate in place of pitch": found.at("rate")[0, 1:],
        "heave in place of pitch": found.at("heave")[0, 1:],
        "whole loop thickness in place of half": 2.0 * printed,
        "half of the half thickness": 0.5 * printed,
        "k = omega c/V in motion and formula": 0.5 * slow,
        "k = omega c/V in the motion only": slow,
        "k = 0.1 and 0.2 exchanged": printed[::-1],
        "moment by span in place of chord": printed * [1.0, BOTH.chord / BOTH.span],
        "moment by arm in place of chord": printed * [1.0, BOTH.chord / ARM],
        f"moment times {factor:.2f} (fitted)": printed * [1.0, factor],
    }


def parts() -> dict[str, FloatArray]:
    """Other surfaces: [k, (C_L, C_m)] by label."""
    cases = [
        Case("tail span 0.721 m on one side", scan.changed(BOTH, "tail", span=0.721)),
        Case("tail span 0.36 m from tip to tip", scan.changed(BOTH, "tail", span=0.18025)),
        Case("wing at 4.5 deg, end plates on the tail", FULL),
        Case("wing only", WING),
        Case("tail out of the wing's wake", scan.only(BOTH, "tail")),
        Case("printed", BOTH),
    ]
    found = dict(zip((case.label for case in cases), scan.oscillations(cases, K, ("pitch",)).at("pitch"), strict=True))
    wing, tail = found["wing only"], found.pop("printed") - found["wing only"]
    found["tail out of the wing's wake"] += wing
    share = float(brentq(lambda x: (wing + x * tail)[0, 1] - OSCILLATION[0, 1], 0.0, 1.0))
    return found | {"tail only": tail, f"tail with {share:.2f} of its lift (fits C_m at k = 0.1)": wing + share * tail}


def places(arms: Arms) -> dict[str, FloatArray]:
    """Other places of tail, pitch axis and moment point: [k, (C_L, C_m)] by label."""
    point = fit(lambda x: arms.at(ARM, 0.0, x[0]), [1.0], OSCILLATION)[0]
    centre = fit(lambda x: arms.at(ARM, x[0], x[0]), [0.2], OSCILLATION)[0]
    best = fit(lambda x: arms.at(x[0], x[1], x[1]), [0.6, 0.0], OSCILLATION)
    found = {
        f"moment point {point:+.2f} c, pitch axis as printed (fitted)": arms.at(ARM, 0.0, point),
        f"CG (axis and moment point) {centre:+.2f} c (fitted)": arms.at(ARM, centre, centre),
    }
    found |= {f"arm {arms.fitted(j, 1):.2f} m (fits C_m at k = {k:g})": arms.at(arms.fitted(j, 1)) for j, k in enumerate(K)}
    found["arm 0.54 m, half of the printed one"] = arms.at(0.5 * ARM)
    found[f"arm {best[0]:.2f} m and CG {best[1]:+.2f} c (two fitted)"] = arms.at(best[0], best[1], best[1])
    found["CG at the leading edge, tail 0.54 m behind it"] = arms.at(0.475, -0.25, -0.25)
    found["arm 0.54 m, pitch axis at the leading edge"] = arms.at(0.5 * ARM, -0.25)
    best = fit(lambda x: arms.at(x[0], x[1], x[2]), [0.4, -0.3, -0.4], OSCILLATION)
    label = f"arm {best[0]:.2f} m, pitch axis {best[1]:+.2f} c, moment point {best[2]:+.2f} c (three fitted)"
    found[label] = arms.at(best[0], best[1], best[2])
    for n in (4, 8):
        scheme = scheme_error(0.5 * ARM, n)
        found[f"arm 0.54 m and an ordinary scheme, {n} panels"] = arms.at(0.5 * ARM) + scheme
        fitted = fit(lambda x, e=scheme: arms.at(x[0]) + e, [0.5], OSCILLATION)[0]
        found[f"arm {fitted:.2f} m (fitted) and an ordinary scheme, {n} panels"] = arms.at(fitted) + scheme
    return found


def centred(geometry: Geometry) -> tuple[float, FloatArray]:
    """CG in chords aft of the printed one that gives the study's C_malpha, and the four steady derivatives there."""
    value = scan.quasi_steady([Case("", geometry)]).value[0]
    aft = float((LIFTING_SURFACE[1] - value[1]) / value[0])
    return aft, scan.quasi_steady([Case("", scan.about(geometry, aft))]).value[0]


def lifting_surface() -> dict[str, FloatArray]:
    """Hypotheses about the steady set: C_Lalpha, C_malpha, C_Lq, C_mq by label."""
    cases = [
        Case("printed geometry", BOTH),
        Case("the same, uniform strips as other codes have", scan.with_uniform_strips(BOTH, UNIFORM)),
    ]
    found = scan.quasi_steady(cases)
    printed, other = found.value[0], found.ordinary[1]
    rows = {cases[0].label: printed, cases[1].label: other}
    sweep = scan.quasi_steady([Case("", with_arm(arm)) for arm in ARMS]).value
    for j, name in ((1, "C_malpha"), (3, "C_mq")):
        arm = float(scan.crossing(ARMS, sweep[:, j], LIFTING_SURFACE[j])[-1])
        rows[f"arm {arm:.2f} m (fits {name})"] = scan.quasi_steady([Case("", with_arm(arm))]).value[0]
    rows["rates as qc/V"] = printed * [1.0, 1.0, 0.5, 0.5]
    shift = float((LIFTING_SURFACE[1] - printed[1]) / printed[0])
    rows[f"moment point {shift:+.3f} c, pitch axis as printed"] = printed + shift * np.array([0.0, printed[0], 0.0, printed[2]])
    body = contributions(FUSELAGE, BOTH)
    rows["with a fuselage (assumed)"] = printed + np.array([body.C_Lalpha, body.C_malpha, body.C_Lq, body.C_mq])
    for label, geometry in (
        ("", BOTH),
        (", with incidence and end plates", FULL),
        (", tail 0.3 m higher", scan.moved(BOTH, ["tail"], up=0.3)),
        (", arm between leading edges", with_arm(ARM - 0.25 * (0.26 - 0.13))),
    ):
        aft, value = centred(geometry)
        rows[f"CG {aft:+.3f} c (fits C_malpha){label}"] = value
    uniform = scan.about(cases[1].geometry, 0.185)
    rows["CG +0.185 c, uniform strips"] = scan.quasi_steady([Case("", uniform)]).ordinary[0]
    rows["CG +0.185 c"] = scan.quasi_steady([Case("", scan.about(BOTH, 0.185))]).value[0]
    return rows
