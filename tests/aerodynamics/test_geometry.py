from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.aerodynamics.geometry import (
    SPACINGS,
    STEEP,
    Geometry,
    Surface,
    mean_line,
    mean_slope,
    mirror,
    points,
    refined,
    tangents,
)
from levelone.errors import InputError

WING = Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.26, 0.26)
PLATE = Surface("end plate", (1.08, 0.3605, -0.1), 0.2, 0.13, 0.13, dihedral=math.pi / 2)
BUMP = ((0.0, 0.0), (0.2, 0.03), (0.4, 0.04), (0.7, 0.025), (1.0, 0.0))
GEOMETRY = Geometry("wing and plate", "", (WING, PLATE), 0.78, 0.26, 3.0, (0.0, 0.0, 0.0))

angles = st.floats(-0.6, 0.6)
dihedrals = st.floats(-math.pi / 2, math.pi / 2)


def corners(surface):
    """[4, 3]: leading and trailing edge of the root, then of the tip."""
    return points(surface, [[0.0], [1.0]], [0.0, 1.0]).reshape(4, 3)


@pytest.mark.theory
def test_corners_of_a_swept_tapered_wing():
    swept = replace(WING, root_chord=0.4, tip_chord=0.2, sweep=math.pi / 4, position=(1.0, 0.5, 0.2))
    expected = [[0.9, 0.5, 0.2], [1.3, 0.5, 0.2], [2.45, 2.0, 0.2], [2.65, 2.0, 0.2]]
    np.testing.assert_allclose(corners(swept), expected, atol=1e-15)


@pytest.mark.theory
def test_incidence_raises_the_nose_about_the_quarter_chord():
    leading, trailing = corners(replace(WING, incidence=math.radians(30.0)))[:2]
    np.testing.assert_allclose(leading, [-0.065 * math.sqrt(0.75), 0.0, 0.0325], atol=1e-15)
    np.testing.assert_allclose(trailing, [0.195 * math.sqrt(0.75), 0.0, -0.0975], atol=1e-15)


@pytest.mark.theory
def test_twist_is_linear_and_leaves_the_root_alone():
    twisted = replace(WING, twist=-0.1, incidence=0.04)
    chord = np.diff(points(twisted, [[0.0], [0.5], [1.0]], [0.0, 1.0]), axis=1)[:, 0]
    np.testing.assert_allclose(np.arctan2(-chord[:, 2], chord[:, 0]), [0.04, -0.01, -0.06], atol=1e-15)


@pytest.mark.theory
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_end_plate_stands_upright_and_positive_incidence_turns_its_nose_to_the_left_if_it_rises(side):
    plate = replace(PLATE, position=(1.08, 0.3605, -0.1 * side), dihedral=side * math.pi / 2, incidence=0.1)
    leading, trailing, tip = corners(plate)[:3]
    assert tip - leading == pytest.approx([0.0, 0.0, 0.2 * side], abs=1e-15)
    np.testing.assert_allclose(trailing - leading, [0.13 * math.cos(0.1), 0.13 * math.sin(0.1) * side, 0.0], atol=1e-15)


@pytest.mark.theory
@given(incidence=angles, dihedral=dihedrals)
def test_the_plane_of_a_surface_is_that_of_sections_turned_about_the_span_axis(incidence, dihedral):
    """Sliding along the span axis changes where the ends are cut, not where the surface lies."""
    surface = replace(WING, incidence=incidence, dihedral=dihedral, mirrored=False)
    leading, trailing, tip, _ = corners(surface)
    normal = np.cross(trailing - leading, tip - leading)
    turned = [
        math.sin(incidence),
        -math.cos(incidence) * math.sin(dihedral),
        math.cos(incidence) * math.cos(dihedral),
    ]
    np.testing.assert_allclose(normal / np.linalg.norm(normal), turned, atol=1e-12)


@given(incidence=angles, twist=angles, dihedral=dihedrals, camber=st.sampled_from([(), BUMP]))
def test_sections_lie_in_planes_that_their_neighbours_share(incidence, twist, dihedral, camber):
    surface = replace(WING, incidence=incidence, twist=twist, dihedral=dihedral, camber=camber, mirrored=False)
    across = 2 if abs(dihedral) > STEEP else 1
    section = points(surface, np.array([0.0, 0.3, 1.0])[:, None], np.linspace(0.0, 1.0, 7))[..., across]
    np.testing.assert_array_equal(section, np.broadcast_to(section[:, :1], section.shape))


def test_halves_with_dihedral_incidence_and_camber_join_without_a_gap():
    root = points(replace(WING, incidence=0.08, dihedral=0.3, camber=BUMP), 0.0, np.linspace(0.0, 1.0, 9))
    np.testing.assert_array_equal(root, mirror(root))


@pytest.mark.theory
def test_camber_lies_on_the_side_that_the_nose_goes_to():
    xi = [0.0, 0.4, 1.0]
    np.testing.assert_allclose(points(replace(WING, camber=BUMP), 0.2, xi)[:, 2], [0.0, 0.04 * 0.26, 0.0], atol=1e-15)
    np.testing.assert_allclose(points(replace(PLATE, camber=BUMP), 0.2, xi)[:, 1] - 0.3605, [0.0, -0.04 * 0.13, 0.0], atol=1e-15)


@pytest.mark.theory
def test_a_parabolic_mean_line_is_met_between_its_points():
    x = np.linspace(0.0, 1.0, 11)
    surface = replace(WING, camber=tuple(zip(x.tolist(), (0.2 * x * (1.0 - x)).tolist(), strict=True)))
    xi = np.linspace(0.0, 1.0, 57)
    np.testing.assert_allclose(mean_line(surface, xi), 0.2 * xi * (1.0 - xi), atol=1e-15)
    np.testing.assert_allclose(mean_slope(surface, xi), 0.2 - 0.4 * xi, atol=1e-13)


@given(
    incidence=angles, twist=angles, dihedral=dihedrals, sweep=angles, eta=st.floats(0.0, 1.0), xi=st.floats(0.01, 0.99),
    camber=st.sampled_from([(), BUMP]),
)  # fmt: skip
def test_tangents_are_the_differences_of_points(incidence, twist, dihedral, sweep, eta, xi, camber):
    surface = Surface(
        "s", (0.3, -0.2, 0.1), 1.2, 0.5, 0.2, sweep, dihedral, twist, incidence, camber, mirrored=False
    )  # fmt: skip
    ahead, behind = points(surface, eta, [xi - 1e-6, xi + 1e-6])
    along = (behind - ahead) / np.linalg.norm(behind - ahead)
    np.testing.assert_allclose(tangents(surface, eta, xi), along, atol=2e-6)


@given(chordwise=st.floats(0.01, 8.0), strips=st.floats(0.01, 8.0))
def test_refinement_touches_the_panel_counts_alone(chordwise, strips):
    finer = refined(GEOMETRY, chordwise, strips)
    for old, new in zip(GEOMETRY.surfaces, finer.surfaces, strict=True):
        assert abs(new.chordwise - old.chordwise * chordwise) <= 0.5 or new.chordwise == 1
        assert abs(new.strips - old.strips * strips) <= 0.5 or new.strips == 1
        assert replace(new, chordwise=old.chordwise, strips=old.strips) == old
    assert replace(finer, surfaces=GEOMETRY.surfaces) == GEOMETRY


def test_half_panels_round_up():
    odd = replace(GEOMETRY, surfaces=(replace(WING, chordwise=5, strips=7),))
    assert [(s.chordwise, s.strips) for s in refined(odd, 0.5, 0.5).surfaces] == [(3, 4)]


@pytest.mark.parametrize("factor", [0.0, -1.0, math.nan, math.inf])
def test_refinement_needs_a_positive_factor(factor):
    with pytest.raises(InputError, match="strips: must be positive"):
        refined(GEOMETRY, 2.0, factor)


BAD = [
    ({"span": 0.0}, "span: must be positive, got 0"),
    ({"span": math.nan}, "span: must be positive, got nan"),
    ({"root_chord": -0.26}, "root_chord: must be positive, got -0.26"),
    ({"tip_chord": 0.0}, "tip_chord: must be positive, got 0"),
    ({"sweep": math.radians(80.0)}, r"sweep: 1.39626 rad \(80 deg\) is outside -75 to 75 deg"),
    ({"dihedral": 1.6}, r"dihedral: 1.6 rad .* is outside -90 to 90 deg"),
    ({"incidence": 4.5}, r"incidence: 4.5 rad \(257.831 deg\) is outside -45 to 45 deg"),
    ({"twist": math.nan}, "twist: nan rad"),
    ({"position": (0.0, math.inf, 0.0)}, "position: must be three finite numbers"),
    ({"position": (0.0, 0.0)}, "position: must be three finite numbers"),
    ({"position": (0.0, -0.5, 0.0)}, "position: y = -0.5 m: a mirrored surface is described by its starboard half"),
    ({"position": (0.0, 0.001, 0.0)}, "position: y = 0.001 m is off the plane of symmetry by less than 1% of the root chord"),
    ({"position": (0.0, 0.01, 0.0), "dihedral": math.pi / 2, "incidence": 0.5}, "position: the surface crosses the plane of symm"),
    ({"dihedral": math.pi / 2}, "mirrored: an upright surface on the plane of symmetry is its own mirror image"),
    ({"camber": ((0.0, 0.01), (1.0, 0.0))}, r"camber: must run from \(0, 0\) to \(1, 0\)"),
    ({"camber": ((0.0, 0.0), (0.5, 0.02))}, r"camber: must run from \(0, 0\) to \(1, 0\)"),
    ({"camber": ((0.0, 0.0), (0.5, 0.02), (0.5, 0.03), (1.0, 0.0))}, "camber: x/c must increase .* 0.5 after 0.5"),
    ({"camber": ((0.0, 0.0), (0.5, 2.0), (1.0, 0.0))}, "camber: z/c = 2 at x/c = 0.5"),
    ({"chordwise": 0}, "chordwise: must be 1 or more, got 0"),
    ({"strips": -3}, "strips: must be 1 or more, got -3"),
    ({"chord_spacing": "cosin"}, "chord_spacing: unknown name 'cosin'; did you mean 'cosine'"),
    ({"span_spacing": "linear"}, "span_spacing: unknown name 'linear'; .*allowed: cosine, uniform"),
]


@pytest.mark.parametrize(("change", "words"), BAD)
def test_bad_surfaces_are_refused_with_the_value_and_what_is_allowed(change, words):
    with pytest.raises(InputError, match=words):
        replace(WING, **change)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"surfaces": ()}, "surface: a geometry needs at least one"),
        ({"surfaces": (WING, replace(PLATE, name="wing"))}, "surface: two surfaces are called 'wing'"),
        ({"area": 0.0}, "area: must be positive"),
        ({"chord": -1.0}, "chord: must be positive"),
        ({"span": math.nan}, "span: must be positive"),
        ({"reference_point": (math.nan, 0.0, 0.0)}, "reference_point: must be three finite numbers"),
    ],
)
def test_bad_geometries_are_refused(change, words):
    with pytest.raises(InputError, match=words):
        replace(GEOMETRY, **change)


def test_what_is_unusual_and_sound_is_accepted():
    left_to_right = replace(WING, position=(0.0, -1.5, 0.0), span=3.0, mirrored=False)
    fin = replace(PLATE, position=(1.0, 0.0, 0.0), mirrored=False)
    v_tail = replace(WING, dihedral=math.radians(45.0), incidence=-0.05)
    assert [s.span for s in (left_to_right, fin, v_tail)] == [3.0, 0.2, 1.5]
    assert {s.chord_spacing for s in (replace(WING, chord_spacing=name) for name in SPACINGS)} == set(SPACINGS)
