"""The report of a study of a model of one's own: one page, made of the same parts as that of the built-in vehicle."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import xarray as xr
from jinja2 import UndefinedError

from levelone.campaign.model_records import programme_test, read_records, read_responses, results_of
from levelone.errors import InputError
from levelone.handling.levels import load_boundaries
from levelone.report import certainty, failure_map, symbols, tables
from levelone.report.formatting import number, percent, percent_interval
from levelone.report.nominal_check import record_plans
from levelone.report.page import Progress, environment, files_of, quiet, write_figures
from levelone.report.pictures import Picture, sensitivity
from levelone.report.results import Results, read_group, read_summary

SECTIONS = (
    "study", "model", "responses", "levels", "nominal", "campaign", "failure_map", "assumed", "not_validated", "validity_domain",
    "provenance",
)  # fmt: skip
RESPONSES = "responses"
"""Owner of responses that a model answers itself."""


def is_model_study(directory: str | PathLike[str]) -> bool:
    """Whether a folder holds the results of a model of one's own."""
    try:
        summary = json.loads((Path(directory) / "results.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(summary, dict) and summary.get("kind") == "model"


def render_model_study(directory: str | PathLike[str], progress: Progress = quiet) -> Path:
    """Draw all figures of a finished study into ``figures/`` and write ``report.html``; return its path.

    Parameters
    ----------
    directory
        Folder that the study wrote.
    progress
        Called after each figure drawn and each file made, with ``"report"``, steps done and steps in all.

    Raises
    ------
    InputError
        The folder holds no results, is incomplete, was written under another schema, or cannot be written to.
    """
    results = _results(Path(directory))
    path = results.directory / "report.html"
    try:
        with symbols.naming(namings(results.summary)):
            plans = _pictures(results)
            drawings = write_figures(results.directory / "figures", plans, files_of(plans, progress))
            page = environment().get_template("model_study.html").render(**_context(results, drawings))
        path.write_text(page, encoding="utf-8", newline="\n")
    except (KeyError, UndefinedError) as error:
        raise InputError(str(results.directory), f"the results miss {error}; run the study again") from error
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path


def _results(folder: Path) -> Results:
    summary = read_summary(folder, SECTIONS)
    return Results(folder, summary, read_group(folder / "monte_carlo.nc"), {}, xr.Dataset(), xr.Dataset())


_WORDS = {
    "quickness": "Attitude quickness", "zeta": "Damping ratio", "omega_n": "Natural frequency", "omega_bw": "Bandwidth",
    "omega_bw_phase": "Phase bandwidth", "omega_bw_gain": "Gain bandwidth", "omega_180": "Frequency of −180 deg",
    "tau_p": "Phase delay", "coherence": "Least coherence", "rise_time": "Rise time of the velocity",
    "overshoot": "Overshoot of the velocity",
}  # fmt: skip


def namings(summary: Mapping[str, Any]) -> dict[str, symbols.Naming]:
    """How each response of the study is called: by its quantity, and by what its test reads."""
    tests = summary["study"]["tests"]
    return {name: _naming(name, tests.get(entry["criterion"])) for name, entry in summary["responses"].items()}


def _naming(name: str, test: Mapping[str, Any] | None) -> symbols.Naming:
    if test is None:
        return symbols.Naming(name, name)
    owner = str(test["name"])
    quantity = name.removesuffix(f"_{owner}")
    words = _WORDS.get(quantity, quantity)
    if quantity.startswith("delta_"):
        words = "Minimum attitude change" if quantity.endswith("_min") else "Peak attitude change"
    if test["criterion"] == "bandwidth":
        words += f" of {_output(test)} / {test['manoeuvre']['axis']}"
    several = owner if quantity != name else ""
    return symbols.Naming(f"{words} ({owner})" if several else words, quantity, several)


def _output(test: Mapping[str, Any]) -> str:
    """What a bandwidth is read on, with its sign."""
    return f"{'−' if test['sign'] < 0 else ''}{test['output']}{'/(jω)' if test['integrate'] else ''}"


def _pictures(results: Results) -> list[Picture]:
    study = results.summary["study"]
    tests = tuple(programme_test(each) for each in study["tests"].values())
    records = read_records(results.directory)
    found = results_of(tests, records, read_responses(results.directory), load_boundaries(study["boundaries"]))
    drawn = record_plans(tests, records, found)
    plans: list[Picture] = []
    for owner in _owners(results):
        plans += [*(picture for picture in drawn if picture.criterion == owner), *sensitivity(results, owner)]
    return [*plans, *certainty.pictures(results), *failure_map.pictures(results)]


def _owners(results: Results) -> list[str]:
    """Tests in the order of the study; one owner for all responses that the model answers itself."""
    found = [entry["criterion"] for entry in results.responses.values()]
    return [*dict.fromkeys([*results.summary["study"]["tests"], *found])]


def _context(results: Results, drawings: list[dict[str, Any]]) -> dict[str, Any]:
    summary = results.summary
    shown: dict[str, list[dict[str, Any]]] = {owner: [] for owner in (*_owners(results), "certainty", "failure_map")}
    for drawing in drawings:
        shown[drawing["section"]].append(drawing)
    return {
        "study": summary["study"],
        "model": summary["model"],
        "provenance": summary["provenance"],
        "summary": summary,
        "rows": tables.summary_rows(results, {}),
        "levels": [_level_row(name, entry) for name, entry in summary["levels"].items()],
        "owners": {owner: _in_words(summary["study"]["tests"].get(owner)) for owner in _owners(results)},
        "findings": [each["text"] for each in summary["nominal"]["findings"] if each["wrong"]],
        "indices": {owner: _indices(results, owner) for owner in _owners(results)},
        "failures": tables.failure_rows(results),
        "certainty": certainty.context(results),
        "failure_map": failure_map.context(results),
        "drawings": shown,
    }


def _in_words(test: Mapping[str, Any] | None) -> str:
    """A test in one sentence, SI and rad; empty for responses that the model answers itself."""
    if test is None:
        return ""
    flown = test["manoeuvre"]
    words = [symbols.CRITERION_TITLES[test["criterion"]], *([test["axis"]] if test["axis"] != "none" else [])]
    if test["method"] == "linear":
        omega = test["omega"]
        words.append(
            f"exact response to {flown['axis']}, {number(omega[0])} to {number(omega[-1])} rad/s, {len(omega)} frequencies"
        )
    else:
        words.append(f"{flown['shape']} of {number(flown['amplitude'])} in {flown['axis']} from {number(flown['on'])} s")
        words.append(f"record of {number(flown['duration'])} s at {number(1.0 / flown['dt'])} Hz")
    if flown["shape"] == "sweep" and test["method"] == "sweep":
        words.append(f"{number(flown['omega_min'])} to {number(flown['omega_max'])} rad/s")
        words.append(f"windows of {', '.join(number(each) for each in test['windows'])} s")
    if test["criterion"] == "bandwidth":
        words.append(f"{test['response_type'].replace('_', ' ')}, read on {_output(test)}")
    return "; ".join(words) + "."


def _level_row(name: str, entry: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "title": "Worst of these" if name == "worst" else name, "n": entry["n"],
        "shares": [percent(entry[key]) for key in ("level_1", "level_2", "level_3", "outside", "failed")],
        "interval": percent_interval(entry["level_1_ci"]),
    }  # fmt: skip


def _indices(results: Results, owner: str) -> list[tuple[Any, ...]]:
    return [
        (symbols.title(name), symbols.html(name), symbols.field_unit(entry["unit"])[1], tables.index_rows(entry))
        for name, entry in results.of(owner).items()
    ]
