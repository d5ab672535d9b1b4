"""``levelone compare``: the claims of a file of findings decided on a finished study, each difference with its cause."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from levelone.campaign.claims import CLAIMS, Evidence
from levelone.campaign.claims.causes import cause_of, outdated, robustness
from levelone.campaign.claims.decision import OUTCOMES, Outcome
from levelone.campaign.claims.evidence import load_evidence
from levelone.campaign.claims.judge import judge
from levelone.campaign.claims.record import FILE as EXPERIMENTS
from levelone.campaign.claims.record import Record, read_record
from levelone.campaign.store import write_json
from levelone.config.experiments_file import load_findings
from levelone.config.study_file import Study
from levelone.errors import InputError

COMPARISON, FINDINGS = "comparison.json", "findings.toml"


@dataclass(frozen=True)
class Verdict:
    """One claim, decided.

    Parameters
    ----------
    id, rule
        As the file of findings states them.
    here
        The numbers of this study in words.
    verdict
        "agrees", "differs" or "undecidable".
    cause
        Of a difference, by experiment; for "undecidable" the reason; empty for "agrees".
    calibrated
        Whether a calibration may aim at the claim: it is shown but not counted.
    robust
        In how many alternative calibrations the verdict is the same.
    numbers
        The numbers of ``here``, SI and radians unless a name ends in ``_deg``.
    """

    id: str
    rule: str
    here: str
    verdict: Outcome
    cause: str
    calibrated: bool
    robust: str
    numbers: Mapping[str, float]


def compare(directory: str | PathLike[str]) -> list[Verdict]:
    """Decide the claims of a finished study, and write ``comparison.json`` into its folder.

    Raises
    ------
    InputError
        The folder is not that of a finished study, names no findings, or cannot be read or written.
    """
    folder = Path(directory)
    found = verdicts_of(load_evidence(folder), folder)
    content: Any = [asdict(each) for each in found]
    try:
        write_json(folder / COMPARISON, content)
    except OSError as error:
        raise InputError(str(folder / COMPARISON), f"cannot be written: {error.strerror}") from None
    return found


def verdicts_of(evidence: Evidence, folder: Path) -> list[Verdict]:
    """Decide the claims of the findings that lie in a results folder, in their order.

    Raises
    ------
    InputError
        The results name no findings, or the files beside them cannot be read.
    """
    name = evidence.summary.get("findings")
    if not name:
        raise InputError(str(folder), "the study names no findings: give it study.findings, and run it again")
    findings = load_findings(folder / Path(name).name)
    record = recorded(folder)
    why_not = outdated(record, evidence.summary)
    out = []
    for finding in findings:
        decision = judge(finding, evidence)
        cause, robust = (say(finding.id, decision, record, why_not) for say in (cause_of, robustness))
        out.append(
            Verdict(
                finding.id, finding.rule, decision.here, decision.verdict, cause, finding.calibrated, robust, dict(decision.numbers)
            )
        )
    return out


def recorded(folder: Path) -> Record | None:
    """The experiments that a results folder holds; None where it holds none."""
    return read_record(folder / EXPERIMENTS)


def take_along(study: Study, folder: Path) -> dict[str, Any]:
    """Copy a study's findings, and the experiments recorded beside it, into its results folder; nothing there is removed.

    Returns
    -------
    dict
        For results.json: the name of the copied findings; empty for a study without findings.
    """
    if study.findings is None:
        return {}
    for name, source in ((FINDINGS, study.findings), (EXPERIMENTS, study.path.parent / EXPERIMENTS)):
        if source.exists() and source.resolve() != (folder / name).resolve():
            shutil.copyfile(source, folder / name)
    return {"findings": FINDINGS}


def counts(verdicts: Sequence[Verdict]) -> dict[Outcome, int]:
    """How many claims have each verdict, without those that a calibration may aim at."""
    counted = [each.verdict for each in verdicts if not each.calibrated]
    return {outcome: counted.count(outcome) for outcome in OUTCOMES}


def left_out(verdicts: Sequence[Verdict]) -> list[str]:
    """Programmed claims that the findings do not name."""
    return [name for name in CLAIMS if name not in {each.id for each in verdicts}]


def in_one_line(verdicts: Sequence[Verdict]) -> str:
    """Counts of the verdicts in words, and what was not counted or not asked."""
    text = ", ".join(f"{count} {outcome}" for outcome, count in counts(verdicts).items())
    aimed = [each for each in verdicts if each.calibrated]
    if aimed:
        text += f"; not counted, since calibrated: {', '.join(f'{each.id} ({each.verdict})' for each in aimed)}"
    missing = left_out(verdicts)
    return text + (f"; not among the findings: {', '.join(missing)}" if missing else "")


def verdict_columns(verdicts: Sequence[Verdict]) -> dict[str, list[str]]:
    """Columns of the short table on the console."""
    return {
        "claim": [each.id for each in verdicts],
        "verdict": [f"({each.verdict})" if each.calibrated else each.verdict for each in verdicts],
        "here": [each.here for each in verdicts],
        "cause": [each.cause for each in verdicts],
        "calibrations": [_short(each.robust) for each in verdicts],
    }


def _short(robust: str) -> str:
    """``7 of 10`` of the words on other calibrations; nothing where there are none."""
    same = robust.partition(":")[0]
    return same.removeprefix("same in ").removesuffix(" calibrations") if same.startswith("same in ") else ""
