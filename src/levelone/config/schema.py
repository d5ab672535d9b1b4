"""What every section of an input file shares: unknown keys, numbers that are not finite, and errors of one line.

Sections are pydantic models; a :class:`pydantic.ValidationError` never leaves this package but becomes an
:class:`~levelone.errors.InputError` that names the file, the path of the value and what is allowed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from levelone.errors import InputError, closest, unknown_name

Finite = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(min_length=1)]
Location = Sequence[int | str]


class Strict(BaseModel):
    """A table of the file: no unknown key, no conversion between types, never changed afterwards."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, arbitrary_types_allowed=True)


Model = TypeVar("Model", bound=Strict)


def check(model: type[Model], content: Mapping[str, Any], where: str) -> Model:
    """The content of a file as its checked model; ``where`` is the file's name for errors.

    Raises
    ------
    InputError
        The first fault: a misspelt key before the value that is missing because of it.
    """
    try:
        return model.model_validate(content)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        first = next((fault for fault in faults if fault["type"] == "extra_forbidden"), faults[0])
        raise _input_error(model, content, where, first) from None


@contextmanager
def in_file(where: str) -> Iterator[None]:
    """Put the file's name before the field of an error."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error.field}", error.problem) from None


@contextmanager
def in_section(section: str) -> Iterator[None]:
    """Put a section before the field of an error that the package's own values raise, unless it is there already."""
    try:
        yield
    except InputError as error:
        known = error.field == section or error.field.startswith(f"{section}.")
        raise InputError(error.field if known else f"{section}.{error.field}", error.problem) from None


def _input_error(model: type[Strict], content: Mapping[str, Any], where: str, fault: Any) -> InputError:
    location: Location = fault["loc"]
    path = _path(location, content)
    field = f"{where}: {path}" if path else where
    kind, given = fault["type"], fault["input"]
    if kind == "extra_forbidden":
        allowed = _keys_at(model, location[:-1])
        parent = _path(location[:-1], content)
        return unknown_name(f"{where}: {parent}" if parent else where, str(location[-1]), allowed)
    if kind == "missing":
        return InputError(field, "missing")
    if kind == "literal_error":
        choices = _choices(fault["ctx"]["expected"])
        return InputError(field, f"{given!r} is not among the choices; {closest(str(given), choices)}")
    problem = fault["ctx"]["error"].problem if isinstance(fault.get("ctx", {}).get("error"), InputError) else None
    return InputError(field, problem or f"is {shown(given)}; {_lower(fault['msg'])}")


def _path(location: Location, content: Any) -> str:
    """Dotted path; an entry of a list of tables goes by its name, others by their place, counted from 1."""
    parts: list[str] = []
    for key in location:
        try:
            content = content[key]
        except (KeyError, IndexError, TypeError):  # what is missing has no content
            content = None
        name = content.get("name") if isinstance(content, Mapping) else None
        parts.append(key if isinstance(key, str) else name if isinstance(name, str) and name else str(key + 1))
    return ".".join(parts)


def _keys_at(model: type[Strict], location: Location) -> list[str]:
    """Keys that the table at a location may hold."""
    for key in location:
        if isinstance(key, str) and key in model.model_fields:  # else it is the user's own name of a table in a table
            model = next(_tables_in(model.model_fields[key].annotation), model)
    return [field.alias or name for name, field in model.model_fields.items()]


def _tables_in(annotation: Any) -> Iterator[type[Strict]]:
    """The models inside an annotation such as ``list[Factor]`` or ``Section | None``."""
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        yield annotation
    for part in get_args(annotation):
        yield from _tables_in(part)


def _choices(expected: str) -> list[str]:
    return [part.strip("' ") for part in expected.replace(" or ", ", ").split(",")]


def shown(given: Any) -> str:
    """A value as an error shows it: on one line, and short."""
    text = repr(given)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _lower(message: str) -> str:
    return message[:1].lower() + message[1:]
