"""Runs of the built-in vehicle found again: nothing flies twice, and what comes back is what was flown, to the last bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign import build_model
from levelone.campaign.store_schema import FILE_NAME
from levelone.campaign.stored_builtin import StoredBuiltin, open_store
from levelone.config.study_file import load_study
from levelone.uncertainty import latin_hypercube

STUDY = Path(__file__).parents[2] / "studies" / "reference" / "study.toml"


@pytest.fixture(scope="module")
def study():
    return load_study(STUDY)


@pytest.fixture(scope="module")
def points(study):
    made = latin_hypercube(study.space, 5, 3).points.copy()
    made[3] = made[1]
    made[4, study.space.names.index("M")] = 60.0  # carries far more than the rotors can: a run without a trim
    return made


def same(a, b) -> None:
    assert np.array_equal(a.responses.values, b.responses.values, equal_nan=True)
    assert np.array_equal(a.responses.status, b.responses.status)
    assert list(a.levels) == list(b.levels)
    assert all(np.array_equal(a.levels[name], b.levels[name]) for name in a.levels)
    assert np.array_equal(a.extrapolated, b.extrapolated)
    for manoeuvre, kept in a.extremes.items():
        assert all(np.array_equal(values, b.extremes[manoeuvre][name], equal_nan=True) for name, values in kept.items())


def test_runs_are_found_again_to_the_last_bit(study, points, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = build_model(study, 1)
    flown = model.assess(points)
    assert flown.responses.failed("quickness").tolist() == [False] * 4 + [True]
    with open_store(tmp_path, study, model) as store:
        same(StoredBuiltin(model, store).assess(points, lambda done: None), flown)
    monkeypatch.setattr(type(model), "assess_batch", lambda *_: pytest.fail("flew again"))
    with open_store(tmp_path, study, model) as store:
        done = []
        same(StoredBuiltin(model, store).assess(points[::-1], done.append), model_reversed(flown))
    assert done == [5]


def model_reversed(assessed):
    r = assessed.responses
    return replace(
        assessed,
        responses=replace(r, values=r.values[::-1], status=r.status[::-1]),
        levels={name: codes[::-1] for name, codes in assessed.levels.items()},
        extrapolated=assessed.extrapolated[::-1],
        extremes={m: {x: v[::-1] for x, v in kept.items()} for m, kept in assessed.extremes.items()},
    )


def test_only_what_is_missing_flies(study, points, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = build_model(study, 1)
    whole = type(model).assess_batch
    flown = []
    monkeypatch.setattr(type(model), "assess_batch", lambda self, batch: flown.append(len(batch)) or whole(self, batch))
    with open_store(tmp_path, study, model) as store:
        StoredBuiltin(model, store).assess(points[:2], lambda done: None)
        StoredBuiltin(model, store).assess(points[:4], lambda done: None)
    assert flown == [2, 1]  # the fourth point is the second one
    assert (tmp_path / FILE_NAME).is_file()


def test_another_manoeuvre_is_another_model(study, points, tmp_path: Path) -> None:
    model = build_model(study, 1)
    with open_store(tmp_path, study, model) as store:
        StoredBuiltin(model, store).assess(points[:1], lambda done: None)
    other = replace(model, step=replace(model.step, amplitude=0.5))
    with open_store(tmp_path, study, other) as store:
        assert not store.lookup(points[:1])[0].any()
