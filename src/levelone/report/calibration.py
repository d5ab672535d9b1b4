"""The page of a calibration."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from jinja2 import UndefinedError

from levelone.errors import InputError
from levelone.report import calibration_figures as figures
from levelone.report import symbols
from levelone.report.formatting import number
from levelone.report.page import environment, files_of, write_figures
from levelone.report.pictures import Picture

SCHEMA = 1
Json = Mapping[str, Any]
_ROLES = {"fit": "fitted", "draw": "not fitted, drawn for each start", "hold": "held"}


def render_calibration(directory: str | PathLike[str]) -> Path:
    """Draw the figures of a finished calibration into ``figures/`` and write ``calibration.html``; return its path.

    Parameters
    ----------
    directory
        Folder that :func:`levelone.campaign.calibration_run.run_calibration` has filled.

    Raises
    ------
    InputError
        The folder holds no calibration, one of another schema, or cannot be written to.
    """
    folder = Path(directory)
    content = _read(folder / "calibration.json")
    try:
        context = _context(content)
        plans = _pictures(content)
        drawings = write_figures(folder / "figures", plans, files_of(plans))
        page = environment().get_template("calibration.html").render(**context, drawings=drawings)
    except (KeyError, UndefinedError) as error:
        raise InputError(str(folder), f"calibration.json misses {error}; calibrate again") from error
    path = folder / "calibration.html"
    try:
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(str(path.parent), f"no calibration here: {path.name} cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise InputError(str(path), f"is not a JSON file: {error}") from error
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise InputError(str(path), f"was not written under schema {SCHEMA}; calibrate again")
    return content


def _pictures(content: Json) -> list[Picture]:
    sensitivities = (
        "Left: relative change of each target for a relative change of each parameter, at the calibrated vehicle. Right: share of "
        "each parameter’s prior variance that the targets remove, and the spread that fits from other starts keep of the spread of "
        "their starts. A parameter counts as identified where the first is at least one half and the second at most one half."
    )
    plans = [Picture("calibration_sensitivities", "calibration", sensitivities, True,
                     partial(figures.draw_sensitivities, content))]  # fmt: skip
    if len(content["starts"]) > 1:
        plans += [
            Picture("calibration_starts", "calibration", "Targets reached from every start.", True,
                    partial(figures.draw_starts, content)),
            Picture("calibration_parameters", "calibration",
                    "Parameters of every fit. What the targets identify comes together; the rest stays where it was put.", True,
                    partial(figures.draw_parameters, content)),
        ]  # fmt: skip
    if content["tradeoff"]:
        plans.append(Picture("calibration_tradeoff", "calibration",
                             f"{symbols.title(content['tradeoff']['response'])} forced through a range, the other targets fitted "
                             "as closely as the priors allow.", True, partial(figures.draw_tradeoff, content)))  # fmt: skip
    return plans


def _context(content: Json) -> dict[str, Any]:
    """Everything that the template shows, apart from the pictures."""
    return {
        "calibration": content["calibration"],
        "vehicle": content["vehicle"],
        "provenance": content["provenance"],
        "method": content["method"],
        "targets": [_target_row(content, target) for target in content["calibration"]["targets"]],
        "parameters": [_parameter_row(content, each) for each in content["calibration"]["parameters"]],
        "unknown": [path for path, found in content["identifiability"]["parameters"].items() if not found["identified"]],
        "pairs": content["identifiability"]["not_apart"],
        "limits": content["identifiability"]["limits"],
        "directions": _direction_rows(content["identifiability"]),
        "responses": [target["response"] for target in content["calibration"]["targets"]],
        "starts": [_run_row(content, run, run["name"]) for run in content["starts"]],
        "met": sum(run["accepted"] for run in content["starts"][1:]),
        "curves": _curve_rows(content),
        "families": content["tradeoff"].get("families", {}),
        "stability": content["checks"]["stability"],
        "inactive": content["checks"]["inactive"],
        "bounds": [_bound_row(limit) for limit in content["checks"]["limits"]],
    }


def _field(value: float, unit: str, digits: int = 4) -> str:
    """An SI value in the unit of the field, without the unit."""
    return number(symbols.field_unit(unit)[0] * value, digits)


def _target_row(content: Json, target: Json) -> dict[str, Any]:
    first, unit = content["starts"][0], target["unit"]
    name = target["response"]
    low, high = target["accept"]
    return {
        "title": symbols.title(name), "symbol": symbols.html(name), "unit": symbols.field_unit(unit)[1] or "1",
        "value": _field(target["value"], unit), "tolerance": _field(target["tolerance"], unit),
        "accept": f"{_field(low, unit)} to {_field(high, unit)}", "reached": _field(first["reached"][name], unit),
        "sigmas": number((first["reached"][name] - target["value"]) / target["tolerance"], 2),
        "met": not any(text.split(":")[0].split(" is ")[0] == name for text in first["missed"]),
        "status": first["status"][name], "origin": target["origin"],
    }  # fmt: skip


def _parameter_row(content: Json, each: Json) -> dict[str, Any]:
    path, found = each["path"], content["identifiability"]["parameters"][each["path"]]
    kept = found["spread_ratio"]
    return {
        "path": path, "ties": each["ties"], "unit": each["unit"], "prior": number(each["prior"]),
        "bounds": f"{number(each['low'])} to {number(each['high'])}", "role": _ROLES[each["role"]],
        "spread": f"× {number(each['spread'])}" if each["scale"] == "log" else f"± {number(each['spread'])}",
        "value": number(content["starts"][0]["values"][path], content["calibration"]["digits"]),
        "removed": found["removed"], "kept": found["spread_status"] if math.isnan(kept) else f"{100.0 * kept:.0f} %",
        "verdict": found["verdict"], "assumed": each["assumed"],
    }  # fmt: skip


def _direction_rows(found: Json) -> list[dict[str, Any]]:
    """The combinations that the targets see, each with its largest parts."""
    rows = []
    for value, parts in zip(found["singular_values"], found["directions"], strict=True):
        largest = sorted(parts.items(), key=lambda item: -abs(item[1]))[:5]
        text = ", ".join(f"{number(part, 2)} {path}" for path, part in largest if abs(part) >= 0.1)
        rows.append({"value": number(value, 3), "text": text})
    return rows


def _run_row(content: Json, run: Json, name: str) -> dict[str, Any]:
    return {
        "name": name,
        "reached": [_field(run["reached"][t["response"]], t["unit"]) for t in content["calibration"]["targets"]],
        "accepted": run["accepted"], "missed": run["missed"], "outcome": run["outcome"], "evaluations": run["evaluations"],
        "undefined": run["undefined"], "target_cost": number(run["target_cost"], 3), "prior_cost": number(run["prior_cost"], 3),
    }  # fmt: skip


def _curve_rows(content: Json) -> list[tuple[str, list[dict[str, Any]]]]:
    curves: Mapping[str, Sequence[Json]] = content["tradeoff"].get("curves", {})
    units = {target["response"]: target["unit"] for target in content["calibration"]["targets"]}

    def row(point: Json) -> dict[str, Any]:
        return _run_row(content, point, _field(point["asked"], units[content["tradeoff"]["response"]]))

    return [(name, [row(point) for point in points]) for name, points in curves.items()]


def _bound_row(limit: Json) -> dict[str, Any]:
    name, unit = limit["response"], limit["unit"]
    return {
        "title": symbols.title(name), "symbol": symbols.html(name), "unit": symbols.field_unit(unit)[1],
        "high": _field(limit["high"], unit), "largest": _field(limit["largest"], unit), "n": limit["n"], "above": limit["above"],
        "failures": sum(limit["failures"].values()), "origin": limit["origin"],
    }  # fmt: skip
