"""Tapers against SciPy's."""

from __future__ import annotations

import pytest
from scipy import signal

from levelone.handling.tapers import TAPERS, taper_of


@pytest.mark.oracle
@pytest.mark.parametrize("name", TAPERS)
@pytest.mark.parametrize("count", [8, 401, 4000])
def test_tapers_are_those_of_scipy(name: str, count: int) -> None:
    assert taper_of(name, count) == pytest.approx(signal.get_window(name, count), abs=1e-14)
