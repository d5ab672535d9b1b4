"""Why a claim differs, and whether its verdict hangs on what the targets of a calibration cannot tell: from recorded trials."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from levelone.campaign.claims.decision import Decision
from levelone.campaign.claims.record import Record, Trial

AGAIN = "run `levelone experiments` again"
NOT_RECORDED = "no experiments are recorded: run `levelone experiments`"
OTHER_STUDY = f"recorded for another vehicle or study: {AGAIN}"
OTHER_SEED = f"recorded for another seed: {AGAIN}"
OTHER_MODEL = f"recorded with another version of the model: {AGAIN}"
OTHER_VERDICT = f"recorded when the claim was decided otherwise: {AGAIN}"
#: flips that are named, of those that there are
NAMED = 3
#: relative change of a nominal response that tells another version of the model from rounding
ROUNDING = 1e-6


def outdated(record: Record | None, summary: Mapping[str, Any]) -> str:
    """Why a record cannot speak for these results; empty where it can."""
    if record is None:
        return NOT_RECORDED
    provenance = summary["provenance"]
    if any(provenance[key] != getattr(record, key) for key in ("study_sha256", "vehicle_sha256")):
        return OTHER_STUDY
    if provenance["seed"] != record.seed:
        return OTHER_SEED
    responses = summary["responses"]
    same = all(name in responses and _same(responses[name]["nominal"], value) for name, value in record.baseline.nominal.items())
    return "" if same else OTHER_MODEL


def _same(a: float, b: float) -> bool:
    return (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=ROUNDING)


def cause_of(name: str, decision: Decision, record: Record | None, why_not: str) -> str:
    """Cause of a claim that differs, reason of one that cannot be decided; empty for one that agrees."""
    if decision.verdict != "differs":
        return decision.reason
    if record is None or why_not:
        return why_not
    recorded = record.baseline.verdicts.get(name)
    if recorded is None or recorded.verdict != decision.verdict:
        return OTHER_VERDICT
    told = [
        f"{each.text} (experiment '{each.experiment}': {_here(record, each.experiment, name)})"
        for each in record.explanations
        if each.id == name
    ]
    return "; ".join([*told, _experiments(name, record)])


def _here(record: Record, experiment: str, name: str) -> str:
    found = next(trial for trial in record.experiments if trial.name == experiment).verdicts[name]
    return f"{found.verdict}, {found.here}"


def _experiments(name: str, record: Record) -> str:
    """Which experiments flip the verdict, and with which numbers; where none does, which comes nearest."""
    tried = [trial for trial in record.of_kind("cause") if name in trial.verdicts]
    flips = [trial for trial in tried if trial.verdicts[name].verdict == "agrees"]
    if flips:
        flips.sort(key=lambda trial: len(lost_targets(trial, record)))
        shown = "; ".join(_shown(trial, name, record) for trial in flips[:NAMED])
        more = f"; and {len(flips) - NAMED} more" if len(flips) > NAMED else ""
        return f"flipped by {len(flips)} of {len(tried)} experiments: {shown}{more}"
    text = f"none of the {len(tried)} experiments tried flips it"
    known = [trial for trial in tried if not math.isnan(trial.verdicts[name].gap)]
    if not known:
        return text
    nearest = min(known, key=lambda trial: trial.verdicts[name].gap)
    if nearest.verdicts[name].gap >= record.baseline.verdicts[name].gap:
        return f"{text}, or brings it nearer"
    return f"{text}; nearest: {_shown(nearest, name, record)}"


def _shown(trial: Trial, name: str, record: Record) -> str:
    lost = lost_targets(trial, record)
    price = f"; misses the target {', '.join(lost)}" if lost else ""
    return f"'{trial.name}' ({trial.verdicts[name].here}{price})"


def lost_targets(trial: Trial, record: Record) -> list[str]:
    """Targets of the calibration that a trial no longer meets while the baseline does."""
    return [
        name
        for name in record.targets
        if record.baseline.verdicts[name].verdict == "agrees" and trial.verdicts[name].verdict != "agrees"
    ]


def robustness(name: str, decision: Decision, record: Record | None, why_not: str) -> str:
    """In how many of the calibrations the verdict is the same."""
    if record is None or why_not:
        return why_not
    found = [trial.verdicts[name].verdict for trial in record.of_kind("calibration") if name in trial.verdicts]
    if not found:
        return "no calibrations are recorded"
    same = found.count(decision.verdict)
    text = f"same in {same} of {len(found)} calibrations"
    return text if same == len(found) else f"{text}: depends on what the targets cannot identify"
