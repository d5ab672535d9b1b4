"""A campaign of 400 runs with four workers, to be killed: ``kill_campaign.py FOLDER`` runs what the folder does not hold."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from executor_models import Logged

from levelone.campaign.evaluate import CampaignInterrupted, evaluate
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.executors.processes import ProcessExecutor

POINTS = np.random.default_rng(20).random((400, 3))
WORKERS, CHUNK = 4, 2


def opened(folder: Path) -> EvaluationStore:
    """The store of the campaign."""
    plain = Logged()
    return EvaluationStore.open(
        folder / "campaign.sqlite", plain.key, plain.names, plain.units, plain.judged, ("a", "b", "c"), study_hash="kill"
    )


def main(folder: Path) -> None:
    """Run what is missing; save what the campaign answers."""
    with opened(folder) as store:
        found = evaluate(Logged(log=str(folder / "log")), POINTS, store, ProcessExecutor(WORKERS, chunk=CHUNK))
    np.savez(folder / "answers.npz", values=found.values, status=found.status, levels=found.levels)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]))
    except CampaignInterrupted as stop:
        print(stop)
        sys.exit(130)
