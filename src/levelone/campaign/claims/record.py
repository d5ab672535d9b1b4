"""The record of experiments, ``experiments.json``: which verdict every claim had on every changed vehicle."""

from __future__ import annotations

import json
from pathlib import Path

from levelone.campaign.claims.decision import Decision, Outcome
from levelone.config.changes import Change
from levelone.config.experiments_file import ExplanationTable, Kind
from levelone.config.files import read_text
from levelone.config.schema import Strict, check
from levelone.errors import InputError

FILE = "experiments.json"


class Stamp(Strict):
    """What a record holds for: of anything else it says nothing."""

    levelone: str
    study_sha256: str
    vehicle_sha256: str
    findings_sha256: str
    seed: int


class Found(Strict):
    """One claim on one vehicle; see :class:`levelone.campaign.claims.decision.Decision`."""

    verdict: Outcome
    here: str
    gap: float

    @classmethod
    def of(cls, decision: Decision) -> Found:
        """What is recorded of a decision: of an undecidable one its reason."""
        return cls(verdict=decision.verdict, here=decision.reason or decision.here, gap=decision.gap)


class Trial(Strict):
    """All claims on one vehicle, and its nominal responses (SI, NaN where undefined)."""

    name: str
    question: str
    kind: Kind
    changes: dict[str, Change]
    nominal: dict[str, float]
    verdicts: dict[str, Found]

    def repeats(self, name: str, kind: Kind, changes: dict[str, Change]) -> bool:
        """Whether this is the trial of that name, with the same changes."""
        return (self.name, self.kind, self.changes) == (name, kind, changes)


class Record(Stamp):
    """All trials of a file of experiments: ``targets`` are the calibrated claims, the baseline is the vehicle as it is."""

    targets: list[str]
    baseline: Trial
    experiments: list[Trial]
    explanations: list[ExplanationTable]

    def holds_for(self, stamp: Stamp) -> bool:
        """Whether the record was made for just this."""
        return all(getattr(self, name) == getattr(stamp, name) for name in Stamp.model_fields)

    def of_kind(self, kind: Kind) -> list[Trial]:
        """The trials of one kind."""
        return [trial for trial in self.experiments if trial.kind == kind]


def read_record(path: Path) -> Record | None:
    """The record in a file; None where there is none.

    Raises
    ------
    InputError
        The file is no record of experiments.
    """
    if not path.exists():
        return None
    try:
        content = json.loads(read_text(path, path.name))
    except ValueError as error:
        raise InputError(str(path), f"is not a JSON file: {error}; delete it and run `levelone experiments` again") from None
    return check(Record, content, str(path))
