from __future__ import annotations

import numpy as np
import pytest
from uncertainty_functions import unit_space

from levelone.errors import InputError
from levelone.uncertainty import Discrete, Factor, FactorSpace, LogNormal, Normal, Uniform

SPACE = FactorSpace(
    [
        Factor("mass", Uniform(6.5, 7.5), unit="kg", source="assumed: weighing"),
        Factor("inertia", Normal(0.4, 0.02), target="I_y", unit="kg m2"),
        Factor("cells", Discrete((4.0, 6.0))),
    ]
)


def test_columns_follow_the_order_of_the_factors():
    points = SPACE.transform([[0.0, 0.5, 0.0], [1.0, 0.5, 1.0]])
    np.testing.assert_allclose(points, [[6.5, 0.4, 4.0], [7.5, 0.4, 6.0]])
    assert SPACE.names == ("mass", "inertia", "cells")
    assert (len(SPACE), SPACE.index("cells"), SPACE["inertia"].target) == (3, 2, "I_y")


def test_unbounded_factors_stay_finite_at_the_ends_of_the_cube():
    space = FactorSpace([Factor("a", Normal(0.0, 1.0)), Factor("b", LogNormal(0.0, 1.0))])
    ends = space.transform([[0.0, 0.0], [1.0, 1.0]])
    assert np.isfinite(ends).all()
    np.testing.assert_allclose(ends[:, 0], [-6.12, 6.12], atol=0.01)
    assert ends[0, 1] > 0.0


def test_boundedness_names_the_factor():
    assert unit_space(2).bounded
    assert not SPACE.bounded
    with pytest.raises(InputError, match=r"factor inertia: .*truncation"):
        SPACE.require_bounded("a Morris design")


def test_an_unknown_name_is_answered_with_the_closest():
    with pytest.raises(InputError, match=r"did you mean 'inertia'\?"):
        SPACE.index("inertai")


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: FactorSpace([]), "at least one"),
        (lambda: FactorSpace([Factor("a", Uniform(0, 1)), Factor("a", Uniform(0, 2))]), "twice: a"),
        (lambda: Factor(" ", Uniform(0, 1)), "not a name"),
        (lambda: Factor("a", (0.0, 1.0)), "not a distribution"),
        (lambda: SPACE.transform([[0.5, 0.5]]), r"\[n, 3\]"),
        (lambda: SPACE.transform([[0.5, 1.5, 0.5]]), "outside 0 to 1"),
        (lambda: SPACE.transform([[0.5, np.nan, 0.5]]), "NaN"),
    ],
)
def test_wrong_input_is_refused(build, words):
    with pytest.raises(InputError, match=words):
        build()
