"""A finding of a file decided by the rule that is programmed for it, if that is its rule."""

from __future__ import annotations

from levelone.campaign.claims import CLAIMS
from levelone.campaign.claims.decision import Claim, Decision, Undecided, undecided
from levelone.campaign.claims.evidence import Evidence
from levelone.campaign.claims.inputs import SPEED
from levelone.config.experiments_file import Finding

NO_RULE = "no rule is programmed for this claim"
CHANGED = "the rule was changed"


def judge(finding: Finding, evidence: Evidence) -> Decision:
    """Decide one finding.

    Undecidable where no rule is programmed under its name, where the file words the rule (or what a calibration may aim
    at) otherwise than it is programmed, away from 5 m/s, where the evidence is missing or undefined, and where runs
    that failed could turn the outcome.
    """
    known = CLAIMS.get(finding.id)
    if known is None:
        return undecided(NO_RULE)
    if finding.rule != known.rule or finding.calibrated != known.calibrated:
        return undecided(CHANGED)
    speed = evidence.summary["study"]["trim_speed"]
    if abs(speed - SPEED) > 1e-6:
        return undecided(f"the study flies at {speed:g} m/s, the claims are about {SPEED:g} m/s")
    return _with_failures(known, evidence)


def _with_failures(known: Claim, evidence: Evidence) -> Decision:
    """The decision, where it stands with undefined runs at the best and at the worst that was seen."""
    found = _decision(known, evidence)
    lost = evidence.undefined(*known.uses)
    if not lost or found.verdict == "undecidable":
        return found
    runs = len(evidence.points)
    ends = [_decision(known, end) for end in evidence.bounded()]
    if all(end.verdict == found.verdict for end in ends):
        return Decision(found.verdict, f"{found.here} ({lost} of {runs} runs undefined)", found.numbers, gap=found.gap)
    words = " and ".join(f"{end.verdict} at the {name} value seen" for end, name in zip(ends, ("smallest", "largest"), strict=True))
    return undecided(f"{lost} of {runs} runs are undefined, which turns the verdict: {words}", found.here, found.numbers)


def _decision(known: Claim, evidence: Evidence) -> Decision:
    try:
        return known.decide(evidence)
    except Undecided as reason:
        return undecided(reason.reason)
    except KeyError as missing:
        return undecided(f"the results lack {missing}: run the study again")
