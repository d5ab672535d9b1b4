"""Cases with other numbers beside them: both are flown, and the first as without the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from levelone.campaign import build_model
from levelone.campaign.cases import cases_section
from levelone.config.study_file import Study
from levelone.config.study_sections import Cases

OTHER = Cases("mine", "dynamic_stability", ("C_mq",), np.array([[-12.0], [-20.0]]), "by hand")
ALONE = Cases("a table", "dynamic_stability", ("C_mq",), np.array([[-7.0], [-16.169]]), "made up")


def flown(study: Study, cases: Cases) -> dict:
    return cases_section(replace(study, cases=(cases,)), build_model(study))["dynamic_stability"]


@pytest.fixture(scope="module")
def pair(study: Study) -> dict:
    return flown(study, replace(ALONE, beside=OTHER))


def test_each_set_is_what_it_is_alone(study: Study, pair: dict) -> None:
    assert {key: each for key, each in pair.items() if key != "beside"} == flown(study, ALONE)
    assert pair["beside"] == flown(study, OTHER)


def test_more_pitch_damping_damps_more(pair: dict) -> None:
    zeta = [*pair["values"]["zeta"], *pair["beside"]["values"]["zeta"]]
    assert [zeta[i] for i in (0, 2, 1, 3)] == sorted(zeta)
