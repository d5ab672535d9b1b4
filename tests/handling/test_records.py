"""Records from plain arrays: what their trim is."""

from __future__ import annotations

import numpy as np
import pytest

from levelone.handling.axes import continuous
from levelone.handling.records import record


def test_a_heading_across_north_has_a_trim(tmp_path):
    """The mean of 359.9 and 0.1 deg is north, not south."""
    time = np.arange(0.0, 3.0, 0.1)
    heading = np.radians(0.2) * np.sin(9.0 * time)
    read = record(time, {"psi": heading % (2.0 * np.pi), "stick": np.zeros_like(time)}, input_name="stick", input_on=2.0)
    turned = np.radians(0.2) * np.sin(9.0 * time[:20]).mean()
    assert np.cos(read.trim["psi"][0] - turned) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(continuous(read.change("psi"))).max() < np.radians(0.5)
