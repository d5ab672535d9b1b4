from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.aerodynamics.intersect import check_intersections, intersections
from levelone.errors import InputError

WING = Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.26, 0.26)
TAIL = Surface("tail", (1.08, 0.0, 0.0), 0.3605, 0.13, 0.13)
PLATE = Surface("plate", (1.08, 0.3605, -0.1), 0.2, 0.13, 0.13, dihedral=math.pi / 2)
FIN = replace(PLATE, name="fin", position=(1.08, 0.0, 0.0), mirrored=False)
INNER = replace(WING, name="inner", span=1.0)


def geometry(*surfaces: Surface) -> Geometry:
    return Geometry("case", "", surfaces, 1.0, 1.0, 1.0, (0.0, 0.0, 0.0))


def pairs(*surfaces: Surface) -> set[tuple[frozenset[str], bool]]:
    return {(frozenset((each.first, each.second)), each.image) for each in intersections(geometry(*surfaces))}


APART = {
    "wing and tail": (WING, TAIL),
    "end plates centred on the tips": (WING, TAIL, PLATE),
    "end plates standing on the tips": (TAIL, replace(PLATE, position=(1.08, 0.3605, 0.0))),
    "end plates hanging from the tips": (TAIL, replace(PLATE, position=(1.08, 0.3605, 0.0), dihedral=-math.pi / 2)),
    "a tip that reaches through by rounding": (TAIL, replace(PLATE, position=(1.08, 0.3604, -0.1))),
    "a fin on the root of the tail": (TAIL, FIN),
    "a fin between the halves of the tail": (TAIL, replace(FIN, position=(1.08, 0.0, -0.1))),
    "a fin in the middle of a tail in one piece": (replace(TAIL, position=(1.08, -0.3605, 0.0), span=0.721, mirrored=False), FIN),
    "an outer panel with more dihedral": (
        replace(INNER, incidence=0.08, twist=-0.02),
        replace(WING, name="outer", position=(0.0, 1.0, 0.0), span=0.5, incidence=0.06, dihedral=math.radians(15.0)),
    ),
    "a winglet": (
        INNER,
        replace(WING, name="winglet", position=(0.0, 1.0, 0.0), span=0.2, dihedral=math.radians(80.0), tip_chord=0.1),
    ),
    "a flap behind the wing": (
        WING,
        replace(WING, name="flap", position=(0.195 + 0.02, 0.0, 0.0), root_chord=0.08, tip_chord=0.08),
    ),
    "a biplane": (WING, replace(WING, name="upper", position=(0.0, 0.0, 0.01))),
    "a V tail": (replace(TAIL, dihedral=math.radians(50.0), incidence=-0.05), WING),
    "dihedral, incidence and twist": (replace(WING, dihedral=0.1, incidence=0.08, twist=-0.05),),
    "a small plate in the hollow of a twisted wing": (
        replace(WING, twist=0.6),
        Surface("small", (0.048, 0.74, -0.042), 0.02, 0.01, 0.01),
    ),
    "a wing from tip to tip and a half behind it": (
        replace(WING, position=(0.0, -1.5, 0.0), span=3.0, mirrored=False),
        replace(TAIL, mirrored=False),
    ),
}


@pytest.mark.parametrize("surfaces", APART.values(), ids=APART)
def test_surfaces_may_touch(surfaces):
    assert pairs(*surfaces) == set()


MEETING = {
    "tail through its end plate": ((TAIL, replace(PLATE, position=(1.08, 0.34, -0.1))), {("tail", "plate", False)}),
    "tail through its end plate by a millimetre": (
        (TAIL, replace(PLATE, position=(1.08, 0.3595, -0.1))),
        {("tail", "plate", False)},
    ),
    "tail in the wing's plane": ((WING, replace(TAIL, position=(0.1, 0.0, 0.0))), {("wing", "tail", False)}),
    "tail in the wing's plane but for rounding": (
        (WING, replace(TAIL, position=(0.1, 0.0, 1e-6))),
        {("wing", "tail", False)},
    ),
    "one in the other": ((WING, replace(TAIL, position=(0.06, 0.5, 0.0))), {("wing", "tail", False)}),
    "the same twice": ((WING, replace(WING, name="copy")), {("wing", "copy", False)}),
    "inclined tail through the wing": ((WING, replace(TAIL, position=(0.05, 0.2, 0.0), incidence=0.3)), {("wing", "tail", False)}),
    "twisted tail through the wing": (
        (WING, replace(TAIL, position=(0.05, 0.2, 0.001), incidence=-0.01, twist=0.1)),
        {("wing", "tail", False)},
    ),
    "trailing edge on the wing": (
        (WING, replace(TAIL, position=(0.0, 0.2, 0.0975 * math.sin(0.5)), incidence=0.5)),
        {("wing", "tail", False)},
    ),
    "fin through a tail in one piece": (
        (replace(TAIL, position=(1.08, -0.3605, 0.0), span=0.721, mirrored=False), replace(FIN, position=(1.08, 0.0, -0.1))),
        {("tail", "fin", False)},
    ),
    "a port half without image and the image of another": (
        (WING, replace(TAIL, position=(0.0, -1.0, 0.0), mirrored=False)),
        {("wing", "tail", True)},
    ),
    "the same, the other way round": (
        (replace(TAIL, position=(0.0, -1.0, 0.0), mirrored=False), WING),
        {("wing", "tail", True)},
    ),
    "three at once": (
        (WING, replace(TAIL, position=(0.0, 0.0, 0.0)), replace(PLATE, position=(0.0, 0.1, -0.1))),
        {("wing", "tail", False), ("wing", "plate", False), ("tail", "plate", False)},
    ),
}


@pytest.mark.parametrize(("surfaces", "expected"), MEETING.values(), ids=MEETING)
def test_surfaces_must_not_pass_through_or_overlap(surfaces, expected):
    assert pairs(*surfaces) == {(frozenset((first, second)), image) for first, second, image in expected}


def test_the_error_names_both_surfaces_and_the_place():
    with pytest.raises(
        InputError, match=r"'tail' and 'plate' intersect near x = .*, y = 0\.34, z = .* m; surfaces may touch"
    ) as error:
        check_intersections(geometry(WING, TAIL, replace(PLATE, position=(1.08, 0.34, -0.1))))
    assert error.value.field == "surface"
    with pytest.raises(InputError, match="'wing' and 'tail' intersect, one of them as its mirror image, near"):
        check_intersections(geometry(WING, replace(TAIL, position=(0.0, -1.0, 0.0), mirrored=False)))


def test_the_place_lies_on_both_surfaces():
    (found,) = intersections(geometry(WING, replace(PLATE, position=(0.1, 0.7, -0.05))))
    x, y, z = found.point
    assert (y, z) == pytest.approx((0.7, 0.0), abs=1e-4)
    assert 0.1 - 0.0325 <= x <= 0.1 + 0.0975


tenths = st.integers(-6, 6).map(lambda n: n / 10)
lengths = st.integers(1, 8).map(lambda n: n / 10)


def box(surface: Surface) -> tuple[float, float, float, float]:
    """Leading and trailing edge, root and tip of an untapered surface, along x and along its span axis."""
    x, y, z = surface.position
    start = z if surface.dihedral else y
    return x - 0.25 * surface.root_chord, x + 0.75 * surface.root_chord, start, start + surface.span


def crossing(a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether two intervals share more than an end."""
    return min(a[1], b[1]) - max(a[0], b[0]) > 1e-6


@st.composite
def rectangles(draw, name, dihedral=0.0):
    chord = draw(lengths)
    position = (draw(tenths) + 0.25 * chord, draw(tenths), draw(tenths) if dihedral else 0.0)
    return Surface(name, position, draw(lengths), chord, chord, dihedral=dihedral, mirrored=False)


@pytest.mark.oracle
@given(a=rectangles("a"), b=rectangles("b"))
def test_level_rectangles_overlap_as_intervals_do(a, b):
    one, other = box(a), box(b)
    expected = crossing(one[:2], other[:2]) and crossing(one[2:], other[2:])
    assert bool(pairs(a, b)) is expected


@pytest.mark.oracle
@given(a=rectangles("a"), b=rectangles("b", math.pi / 2))
def test_a_level_and_an_upright_rectangle_cross_as_intervals_do(a, b):
    one, other = box(a), box(b)
    inside = one[2] + 1e-6 < b.position[1] < one[3] - 1e-6 and other[2] + 1e-6 < 0.0 < other[3] - 1e-6
    assert bool(pairs(a, b)) is (inside and crossing(one[:2], other[:2]))


shifts = st.floats(-3.0, 3.0).map(lambda v: round(v, 3))


@st.composite
def surfaces(draw, name):
    return Surface(
        name, (draw(tenths), draw(tenths), draw(tenths)), draw(lengths), draw(lengths), draw(lengths), draw(tenths), draw(tenths),
        draw(st.sampled_from([0.0, 0.2])), draw(st.sampled_from([0.0, 0.3])), mirrored=False,
    )  # fmt: skip


three = st.tuples(surfaces("a"), surfaces("b"), surfaces("c"))


@settings(max_examples=40)
@given(given_surfaces=three, order=st.permutations(range(3)), shift=st.tuples(shifts, shifts, shifts))
def test_neither_order_nor_place_matters(given_surfaces, order, shift):
    moved = [replace(s, position=tuple((np.array(s.position) + shift).tolist())) for s in given_surfaces]
    assert pairs(*(moved[i] for i in order)) == pairs(*given_surfaces)


def reflected(surface: Surface) -> Surface:
    """The mirror image at y -> -y as a surface of its own, root and tip exchanged so that it runs from port to starboard."""
    x, y, z = surface.position
    tip = (x + surface.span * math.tan(surface.sweep), -y - surface.span * math.cos(surface.dihedral))
    return replace(
        surface,
        position=(*tip, z + surface.span * math.sin(surface.dihedral)),
        root_chord=surface.tip_chord,
        tip_chord=surface.root_chord,
        sweep=-surface.sweep,
        dihedral=-surface.dihedral,
        incidence=surface.incidence + surface.twist,
        twist=-surface.twist,
    )


@settings(max_examples=40)
@given(first=surfaces("a"), second=surfaces("b"))
def test_an_image_meets_the_image_of_what_the_surface_meets(first, second):
    first = replace(first, position=(0.0, 1.5, 0.0), mirrored=True)
    second = replace(second, position=(0.3 * second.position[0], 1.5, 0.2 * second.position[2]))
    assert pairs(first, second) <= {(frozenset("ab"), False)}
    assert pairs(first, reflected(second)) == {(names, True) for names, _ in pairs(first, second)}


def test_text_of_the_error_is_one_line():
    with pytest.raises(InputError) as error:
        check_intersections(geometry(WING, replace(WING, name="copy")))
    assert re.fullmatch(r"[^\n]+", str(error.value))
