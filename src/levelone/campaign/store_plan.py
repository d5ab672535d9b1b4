"""How much of what a study needs the store of its campaign holds.

Other studies, seeds and sizes of samples leave their evaluations in the same store: to count all of them says nothing about the
study that runs now, which therefore writes down what it is going to need
(:meth:`levelone.campaign.evaluation_store.EvaluationStore.plan`).
"""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from levelone.campaign.store_schema import refusing


@dataclass(frozen=True)
class Plan:
    """What the study that ran last needs.

    Parameters
    ----------
    model
        Hash of its model.
    study
        Its title.
    planned
        Number of different evaluations.
    held
        How many of those the store holds, whoever asked for them first.
    """

    model: str
    study: str
    planned: int
    held: int


def read_plan(connection: sqlite3.Connection, path: Path) -> Plan | None:
    """What the study that ran last needs, and how much of it is held; None where no study has said so."""
    query = (
        "SELECT model.hash, study.title, count(*), count(evaluation.id) FROM plan JOIN model ON model.id = plan.model "
        "JOIN study ON study.id = plan.study LEFT JOIN evaluation ON evaluation.key = plan.key GROUP BY model.hash, study.title"
    )
    with refusing(path):
        rows = connection.execute(query).fetchall()
    return Plan(*rows[0]) if rows else None
