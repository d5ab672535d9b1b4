"""Dakota's parameters files: one evaluation or a batch of them, standard, APREPRO or JSON, told apart by what they hold."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from levelone.errors import InputError

APREPRO = re.compile(r"^\s*\{\s*(\S+)\s*=\s*(.*?)\s*\}\s*$")
#: tag that opens and closes each kind of list in the two formats of plain text
TAGS = {
    "standard": ("variables", "functions", "derivative_variables", "analysis_components", "eval_id", "metadata"),
    "aprepro": ("DAKOTA_VARS", "DAKOTA_FNS", "DAKOTA_DER_VARS", "DAKOTA_AN_COMPS", "DAKOTA_EVAL_ID", "DAKOTA_METADATA"),
}


@dataclass(frozen=True)
class Evaluation:
    """What Dakota asks for: values of the variables by descriptor, and the response descriptors with their active sets, in order.

    Of an active set bit 1 asks for the value, 2 for the gradient, 4 for the Hessian.
    """

    identifier: str
    variables: Mapping[str, float]
    active: Mapping[str, int]


def read_parameters(path: Path) -> tuple[Evaluation, ...]:
    """Evaluations of a parameters file, in its order.

    Raises
    ------
    InputError
        A file that cannot be read, is of no known format or ends early; a variable that is no number; a name given twice.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("parameters file", f"cannot read {path}: {getattr(error, 'strerror', None) or 'it is no text'}") from None
    start = text.lstrip()[:1]
    try:
        if start == "[" or (start == "{" and not APREPRO.match(text.lstrip().splitlines()[0])):
            found = _from_json(text)
        elif start == "{":
            found = _from_lines(_aprepro_rows(text), *TAGS["aprepro"])
        else:
            found = _from_lines(_standard_rows(text), *TAGS["standard"])
    except _Malformed as problem:
        raise InputError("parameters file", f"{path} is no parameters file of Dakota: {problem}") from None
    if not found:
        raise InputError("parameters file", f"{path} holds no evaluation")
    return found


class _Malformed(Exception):
    """Says what is wrong with the text."""


def _standard_rows(text: str) -> Iterator[tuple[str, str]]:
    """(tag, value) of each line that is not empty."""
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split(maxsplit=1)
        if len(words) == 1:
            raise _Malformed(f"line {number} is {line.strip()!r}: a value and its name are needed")
        if words:
            yield words[1].strip(), words[0]


def _aprepro_rows(text: str) -> Iterator[tuple[str, str]]:
    for number, line in enumerate(text.splitlines(), 1):
        match = APREPRO.match(line)
        if match is None and line.strip():
            raise _Malformed(f"line {number} is {line.strip()!r}: {{ name = value }} is needed")
        if match is not None:
            yield match[1], match[2].strip("\"'")


def _from_lines(
    rows: Iterator[tuple[str, str]],
    variables: str,
    functions: str,
    derivatives: str,
    components: str,
    identifier: str,
    metadata: str,
) -> tuple[Evaluation, ...]:
    """Lists of fixed order, each after its length: one evaluation after another until the lines end."""
    found = []
    for tag, value in rows:
        names = _list(rows, tag, value, variables)
        asked = _list(rows, *_next(rows), functions)
        _list(rows, *_next(rows), derivatives)
        _list(rows, *_next(rows), components)
        tag, name = _next(rows)
        if tag != identifier:
            raise _Malformed(f"{tag!r} stands where {identifier!r} is needed")
        _list(rows, *_next(rows), metadata)
        found.append(_evaluation(name, names, [(_response(label), each) for label, each in asked]))
    return tuple(found)


def _next(rows: Iterator[tuple[str, str]]) -> tuple[str, str]:
    row = next(rows, None)
    if row is None:
        raise _Malformed("it ends inside an evaluation")
    return row


def _list(rows: Iterator[tuple[str, str]], tag: str, value: str, expected: str) -> list[tuple[str, str]]:
    if tag != expected or not value.isdigit():
        raise _Malformed(f"'{value} {tag}' stands where the number of {expected!r} is needed")
    return [_next(rows) for _ in range(int(value))]


def _response(label: str) -> str:
    """The descriptor in ``ASV_3:zeta``."""
    return label.partition(":")[2] or label


def _from_json(text: str) -> tuple[Evaluation, ...]:
    try:
        content = json.loads(text)
    except ValueError as error:
        raise _Malformed(f"{error}") from None
    try:
        return tuple(
            _evaluation(
                str(each["eval_id"]),
                [(item["label"], item["value"]) for item in each["variables"]],
                [(item["label"], item["active_set"]) for item in each["responses"]],
            )
            for each in (content if isinstance(content, list) else [content])
        )
    except (KeyError, TypeError) as error:
        raise _Malformed(f"{error} is missing or of another form") from None


def _evaluation(identifier: str, variables: list[tuple[str, Any]], asked: list[tuple[str, Any]]) -> Evaluation:
    values = {name: _number(name, value) for name, value in variables}
    active = {name: int(_number(name, value)) for name, value in asked}
    if len(values) != len(variables) or len(active) != len(asked):
        raise _Malformed(f"evaluation {identifier} has a name twice")
    return Evaluation(identifier, values, active)


def _number(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise _Malformed(f"{name} is {value!r}, and a finite number is needed")
    return number
