"""The page of a nominal case: responses, what looks wrong, records with the picked peaks, and frequency responses as read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from levelone import __version__
from levelone.campaign.models.readings import Result, Spectral
from levelone.campaign.nominal_check import NominalCheck
from levelone.config.model_table import BuiltInTable, Channel, Test
from levelone.errors import InputError
from levelone.handling.history import TimeHistory
from levelone.report import nominal_figures as figures
from levelone.report import symbols
from levelone.report.formatting import number
from levelone.report.page import environment, files_of, write_figures
from levelone.report.pictures import Picture
from levelone.report.tables import LEVEL_WORDS

PAGE = "check.html"
_CAPTIONS = {
    "attitude_quickness": "Command and response, with what the criterion reads: first peak of the rate, peak of the attitude, "
    "second stationary point of the rate.",
    "dynamic_stability": "Command and response, with the peaks of the free rate that the criterion reads; the free response "
    "begins at the end of the grey band.",
    "bandwidth": "Command and response of the sweep.",
    "translational_rate": "Commanded and flown speed.",
}


def render_check(folder: Path, check: NominalCheck) -> Path:
    """Write ``check.html`` and its figures in ``figures/``; return the page's path.

    Raises
    ------
    InputError
        The folder cannot be made or written to.
    """
    plans = record_plans(check.study.tests, check.histories, check.results)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(folder), f"cannot be made: {error.strerror}") from error
    drawings = write_figures(folder / "figures", plans, files_of(plans))
    page = environment().get_template("nominal_check.html").render(**_context(check), drawings=drawings)
    path = folder / PAGE
    try:
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path


def record_plans(tests: Sequence[Test], histories: Mapping[str, TimeHistory], results: Mapping[str, Result]) -> list[Picture]:
    """Pictures of the record of each test with what was picked, and of each frequency response with what was read."""
    plans = []
    for test in tests:
        history, result = histories.get(test.name), results.get(test.name)
        if history is not None:
            draw = partial(figures.draw_record, test, history, result)
            plans.append(Picture(f"record_{test.name}", test.name, _CAPTIONS[test.criterion], True, draw))
        if isinstance(result, Spectral):
            output = f"{'−' if test.sign < 0 else ''}{test.output}{'/(jω)' if test.integrate else ''}"
            caption = (
                f"{output} over {test.manoeuvre.axis}: gain, phase"
                f"{'' if result.response.coherence is None else ' and coherence'}, with the frequencies that were read."
            )
            draw = partial(figures.draw_response, test, result)
            plans.append(Picture(f"response_{test.name}", test.name, caption, False, draw))
    return plans


def _context(check: NominalCheck) -> dict[str, Any]:
    """Everything that the template shows, apart from the pictures."""
    study = check.study
    return {
        "study": study,
        "version": __version__,
        "wrong": check.wrong,
        "notes": [finding for finding in check.findings if not finding.wrong],
        "responses": [(each, symbols.html(each.name), number(each.value)) for each in check.responses],
        "levels": [(name, LEVEL_WORDS[level]) for name, level in check.levels.items()],
        "message": check.message,
        "seconds": number(check.seconds, 3),
        "factors": [
            {"name": factor.name, "target": target, "unit": factor.unit, "value": number(float(value))}
            for factor, target, value in zip(study.space.factors, study.targets, study.nominal, strict=True)
        ],
        "built_in": isinstance(study.model, BuiltInTable),
        "channels": [*(_channel(each, "input") for each in study.inputs), *(_channel(each, "output") for each in study.outputs)],
        "tests": [test.name for test in study.tests],
    }


def _channel(channel: Channel, way: str) -> dict[str, str]:
    trim = "" if way == "output" else "held" if channel.trim is None else f"{number(channel.trim)} {channel.unit}"
    return {
        "way": way, "name": channel.levelone, "model": channel.name, "unit": channel.unit,
        "sign": "+" if channel.sign > 0 else "−", "scale": number(channel.scale), "trim": trim,
    }  # fmt: skip
