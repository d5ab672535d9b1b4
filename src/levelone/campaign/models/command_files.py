"""The two files of a command model: parameters that it is given and results that it leaves, in Dakota's format or in JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.mapping import real_numbers
from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import Channel
    from levelone.handling.manoeuvres import Manoeuvre

#: bytes of a results file that are read; a record of 10 channels over 100 s at 1 kHz has some 20 MB
LARGEST = 256 * 2**20
INPUT = "input.csv"


def dakota_parameters(parameters: Mapping[str, float], responses: Sequence[str]) -> str:
    """A parameters file in Dakota's standard format that asks for the value of every response, numbers to the last bit.

    Source: Dakota 6.24 User's Manual, "Parameters file format (standard)": each list after its length, the value before its name.
    """
    rows: list[tuple[str, str]] = [(str(len(parameters)), "variables")]
    rows += [(f"{value:.17e}", name) for name, value in parameters.items()]
    rows += [(str(len(responses)), "functions"), *(("1", f"ASV_{i}:{name}") for i, name in enumerate(responses, 1))]
    rows += [(str(len(parameters)), "derivative_variables")]
    rows += [(str(i), f"DVV_{i}:{name}") for i, name in enumerate(parameters, 1)]
    rows += [("0", "analysis_components"), ("1", "eval_id"), ("0", "metadata")]
    return "".join(f"{value:>40} {tag}\n" for value, tag in rows)


def dakota_results(text: str, responses: Sequence[str]) -> dict[str, float]:
    """Values of a results file in Dakota's standard format: "value" or "value descriptor" a line; all labelled or none.

    Parameters
    ----------
    text
        Content of the file. One that begins with "fail", in any case, is a failure that the program declares.
    responses
        Names, in the order in which values without a descriptor stand.

    Raises
    ------
    ModelFailure
        A declared failure, or text of another form.
    """
    rows = [line.split() for line in text.splitlines() if line.strip()]
    if rows and rows[0][0].lower().startswith("fail"):
        raise ModelFailure(Status.MODEL_FAILED, f"the command declares a failure: {' '.join(rows[0])}")
    for row in rows:
        if len(row) > 2 or row[0].startswith("["):
            raise _unreadable(f"{' '.join(row)[:80]!r} stands where a value and its descriptor are needed")
    labelled = {len(row) == 2 for row in rows}
    if labelled == {False}:
        if len(rows) != len(responses):
            raise _unreadable(f"it holds {len(rows)} values without descriptors, and {len(responses)} responses are asked for")
        return {name: _value(name, row[0]) for name, row in zip(responses, rows, strict=True)}
    if labelled == {True, False}:
        raise _unreadable("some values have a descriptor and others have none")
    if len({row[1] for row in rows}) != len(rows):
        raise _unreadable("a descriptor stands twice")
    return {name: _value(name, value) for value, name in rows}


def json_parameters(
    evaluation: str, parameters: Mapping[str, float], manoeuvre: Manoeuvre | None = None, channel: Channel | None = None
) -> str:
    """A parameters file in JSON; with a manoeuvre it says what is commanded, in the unit of the model's input ``channel``."""
    content: dict[str, Any] = {"evaluation": evaluation, "parameters": dict(parameters)}
    if manoeuvre is not None and channel is not None:
        content["manoeuvre"] = _manoeuvre(manoeuvre, channel)
        means = "change from trim" if channel.trim is None else "value"
        content["input"] = {"name": channel.name, "unit": channel.unit, "file": INPUT, "means": means}
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _manoeuvre(manoeuvre: Manoeuvre, channel: Channel) -> dict[str, Any]:
    told: dict[str, Any] = {
        "command": manoeuvre.axis,
        "shape": manoeuvre.shape,
        "amplitude": manoeuvre.amplitude / (channel.sign * channel.scale),
        "on": manoeuvre.on,
        "duration": manoeuvre.duration,
        "dt": 1.0 / manoeuvre.controller_rate,
    }
    if math.isfinite(manoeuvre.off):
        told["off"] = manoeuvre.off
    if manoeuvre.shape == "sweep":
        told |= {"omega_min": manoeuvre.omega_min, "omega_max": manoeuvre.omega_max, "fade": manoeuvre.fade}
    return told


def input_csv(name: str, time: FloatArray, values: FloatArray) -> str:
    """The command as a table of time (s) and input (model's unit), numbers to the last bit."""
    rows = "".join(f"{t!r},{value!r}\n" for t, value in zip(time.tolist(), values.tolist(), strict=True))
    return f"time,{name}\n{rows}"


def json_responses(text: str) -> dict[str, Any]:
    """Responses of ``{"responses": {name: number}}``; "nan", "inf" and "-inf" may stand as texts.

    Raises
    ------
    ModelFailure
        Text that is not that.
    """
    answer = _object(text).get("responses")
    if not isinstance(answer, dict):
        raise _unreadable('it holds no "responses" with a number for each name')
    return {name: _value(name, value) if isinstance(value, str) else value for name, value in answer.items()}


def json_history(text: str, folder: Path) -> dict[str, FloatArray]:
    """Columns of ``{"time": [...], "channels": {name: [...]}}`` or of ``{"file": "flight.csv"}``, a table in the same folder.

    Raises
    ------
    ModelFailure
        Text that is not that; a file that lies elsewhere, is missing or holds no table.
    """
    content = _object(text)
    if "file" in content:
        return _table(folder, content["file"])
    time, channels = content.get("time"), content.get("channels")
    if not isinstance(time, list) or not isinstance(channels, dict):
        raise _unreadable('it holds neither "time" with "channels" nor "file"')
    return {name: _series(name, values) for name, values in {**channels, "time": time}.items()}


def read_limited(path: Path) -> str:
    """Text of a file that the command left; ModelFailure where it left none, or one that cannot be read."""
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise _unreadable(f"{path.name} has {size} bytes, and {LARGEST} are the most")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ModelFailure(Status.OUTPUT_MISSING, f"the command left no file {path.name}") from None
    except OSError as error:
        raise _unreadable(f"{path.name}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise _unreadable(f"{path.name} is no UTF-8 text") from None


def _table(folder: Path, name: Any) -> dict[str, FloatArray]:
    path = _inside(folder, name)
    if path is None:
        raise ModelFailure(
            Status.OUTPUT_MISSING, f"the results name a file {str(name)[:80]!r}, which is none of the evaluation's directory"
        )
    lines = read_limited(path).splitlines()
    names = [each.strip() for each in lines[0].split(",")] if lines else []
    if len(set(names)) != len(names) or "time" not in names:
        raise _unreadable(f"the first row of {path.name} must name its columns once each, time among them")
    if len(lines) < 3:
        raise _unreadable(f"{path.name} has {max(len(lines) - 1, 0)} rows of numbers, and two are the least")
    try:
        table = np.loadtxt(lines[1:], delimiter=",", ndmin=2, comments=None)
    except ValueError as error:
        raise _unreadable(f"{path.name}: {error}") from None
    if table.shape[1] != len(names):
        raise _unreadable(f"{path.name} has {table.shape[1]} columns under {len(names)} names")
    return dict(zip(names, np.ascontiguousarray(table.T), strict=True))


def _inside(folder: Path, name: Any) -> Path | None:
    """File of a directory by its name; None where there is none, or it lies elsewhere, links followed."""
    try:
        path = (folder / name).resolve()
        return path if path.is_relative_to(folder.resolve()) and path.is_file() else None
    except (TypeError, ValueError, OSError):  # a name that is no text, or that no file system takes
        return None


def _object(text: str) -> dict[str, Any]:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _unreadable(f"it is no JSON: {error}") from None
    if not isinstance(content, dict):
        raise _unreadable(f"it is a {type(content).__name__} of JSON, and an object is needed")
    return content


def _series(name: str, values: Any) -> FloatArray:
    """A list of numbers; null is how some programs write a number that is not finite."""
    try:
        return real_numbers(values)
    except (TypeError, ValueError):
        raise _unreadable(f"channel {name} holds something that is no number") from None


def _value(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise _unreadable(f"{name} is {text[:40]!r}, and a number is needed") from None


def _unreadable(problem: str) -> ModelFailure:
    return ModelFailure(Status.MODEL_FAILED, f"the results cannot be read: {problem}")
