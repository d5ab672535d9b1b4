"""The examples in the docstrings are run."""

from __future__ import annotations

import doctest

import pytest

from levelone.handling import bandwidth, manoeuvres


@pytest.mark.parametrize("module", [bandwidth, manoeuvres], ids=lambda module: module.__name__)
def test_docstring_examples(module):
    outcome = doctest.testmod(module)
    assert outcome.attempted > 0
    assert outcome.failed == 0
