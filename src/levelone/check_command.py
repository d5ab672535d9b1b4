"""The command ``levelone check``: the nominal case of a study, and what looks wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from levelone.console import announce_compilation, say, show

if TYPE_CHECKING:
    from levelone.campaign.nominal_check import NominalCheck

LOOKS_WRONG = 1
StudyArgument = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of check.html and its figures.  [default: results/NAME]")]


def check(study: StudyArgument, out: Out = None) -> None:
    """Run the nominal case of a study once and say what looks wrong; ends with 1 where something does."""
    from levelone.config.model_study import is_model_study, load_model_study
    from levelone.config.study_file import load_study

    own = is_model_study(study)
    given = load_model_study(study) if own else load_study(study)
    announce_compilation()
    from levelone.campaign.nominal_check import as_model_study, check_nominal

    checked = check_nominal(given if own else as_model_study(given))  # type: ignore[arg-type]
    from levelone.report.nominal_check import render_check

    page = render_check(out if out is not None else Path("results") / checked.study.name, checked)
    show(f"Nominal case of {checked.study.name}", _columns(checked))
    for finding in checked.findings:
        say(f"{'looks wrong' if finding.wrong else 'note'}: {finding.rule}, {finding.where}: {finding.text}")
    if checked.message:
        say(f"the model says: {' '.join(checked.message.split())[-500:]}")
    say(_verdict(checked))
    say(f"check: {page}")
    if checked.wrong:
        raise typer.Exit(LOOKS_WRONG)


def _columns(checked: NominalCheck) -> dict[str, list[Any]]:
    return {
        "response": [each.name for each in checked.responses],
        "value": [each.value for each in checked.responses],
        "unit": [each.unit for each in checked.responses],
        "status": [each.status.text for each in checked.responses],
    }


def _verdict(checked: NominalCheck) -> str:
    count = len(checked.wrong)
    return "nothing looks wrong" if count == 0 else f"{count} {'thing looks' if count == 1 else 'things look'} wrong"
