"""The [model] section of a study file becomes a description of the model; nothing is imported, opened or run."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from levelone.config import model_schema as schema
from levelone.config.model_table import (
    BuiltInTable,
    Channel,
    CommandTable,
    FmuTable,
    JsbsimTable,
    ModelDescription,
    PythonTable,
    ResponseName,
    StateSpaceTable,
)
from levelone.config.schema import Strict
from levelone.config.units import to_si
from levelone.config.vehicle_file import load_vehicle, vehicle_path
from levelone.errors import InputError, closest, unknown_name
from levelone.handling.manoeuvres import UNITS
from levelone.handling.records import CHANNEL_UNITS

_FUNCTION = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*", re.ASCII)
_MOST_LISTED = 500


def check_kind(content: Mapping[str, Any], name: str) -> str:
    """Kind of the [model] table of a file, and a refusal of keys that only other kinds have.

    Raises
    ------
    InputError
        No table, no kind or an unknown one; a key of another kind.
    """
    table = content.get("model")
    if not isinstance(table, dict):
        raise InputError(f"{name}: model", "must be a table with the kind of the model")
    kind = table.get("kind")
    if kind is None:
        raise InputError(f"{name}: model.kind", f"missing; {closest('', schema.SECTIONS)}")
    if not isinstance(kind, str) or kind not in schema.SECTIONS:
        raise unknown_name(f"{name}: model.kind", str(kind)[:60], schema.SECTIONS)
    takes = [key for key in schema.SECTIONS[kind].model_fields if key != "kind"]
    others = {key for section in schema.SECTIONS.values() for key in section.model_fields}
    for key in table:
        if key in others and key not in ("kind", *takes):
            raise InputError(f"{name}: model.{key}", f'has no place here: kind = "{kind}" takes {", ".join(takes)}')
    return kind


def description_of(section: Strict, folder: Path, responses: Sequence[ResponseName]) -> ModelDescription:
    """The model that a study file describes.

    Parameters
    ----------
    section
        [model] of its kind.
    folder
        Of the study file, from which relative paths start.
    responses
        What the model answers itself, where it does.

    Raises
    ------
    InputError
        A file or folder that is not there, an unknown channel or command, a unit that does not fit, a name mapped twice.
    """
    if isinstance(section, schema.BuiltInSection):
        return _built_in(section, folder)
    if not isinstance(section, schema.MappedSection):
        raise TypeError(f"{type(section).__name__} is no section of a model")
    common = {
        "kind": section.kind,  # type: ignore[attr-defined]  # every kind has it
        "fixed": tuple(section.fixed.items()),
        "inputs": tuple(_channels(section.inputs, UNITS, "model.inputs")),
        "outputs": tuple(_channels(section.outputs, CHANNEL_UNITS, "model.outputs")),
    }
    if isinstance(section, schema.PythonSection | schema.CommandSection):
        return _answering(section, folder, tuple(responses), common)
    if isinstance(section, schema.FmuSection):
        if section.tolerance is not None and section.mode == "co-simulation":
            raise InputError("model.tolerance", 'has no place here: mode = "co-simulation" integrates with a tolerance of its own')
        return FmuTable(**common, **_plain(section, "mode", "step", "settle", "tolerance"), file=_file(folder, section.file))
    if isinstance(section, schema.StateSpaceSection):
        for name, table in section.inputs.items():
            if table.trim != "hold":
                raise InputError(f"model.inputs.{name}.trim", "has no place here: a linear model knows changes from trim only")
        return StateSpaceTable(**common, file=_file(folder, section.file))
    assert isinstance(section, schema.JsbsimSection)
    return JsbsimTable(
        **common,
        **_plain(section, "aircraft", "step", "engines_running", "settle", "random_seed"),
        folder=_folder(folder, section.folder),
        initial=tuple(section.initial.items()),
        set=tuple(section.set.items()),
    )


def _plain(section: Strict, *names: str) -> dict[str, Any]:
    return {name: getattr(section, name) for name in names}


def _built_in(section: schema.BuiltInSection, folder: Path) -> BuiltInTable:
    given = section.vehicle
    try:
        where = vehicle_path(folder / given if given.endswith(".toml") else given)
    except InputError as error:
        raise InputError("model.vehicle", error.problem) from None
    return BuiltInTable(
        kind="built-in",
        fixed=(),
        inputs=(),
        outputs=(),
        vehicle=load_vehicle(where),
        vehicle_path=where,
        **_plain(section, "trim_speed", "flight_mode", "start"),
    )


def _answering(
    section: schema.PythonSection | schema.CommandSection, folder: Path, responses: tuple[ResponseName, ...], common: dict[str, Any]
) -> PythonTable | CommandTable:
    common = {**common, "gives": section.gives, "responses": responses, "folder": _folder(folder, section.folder)}
    if isinstance(section, schema.PythonSection):
        if not _FUNCTION.fullmatch(section.function):
            raise InputError("model.function", f"is {section.function!r}; write it like 'package.module:name'")
        if section.vectorised and section.gives == "histories":
            raise InputError("model.vectorised", 'has no place here: it goes with gives = "responses"')
        return PythonTable(**common, **_plain(section, "function", "vectorised"))
    if not section.arguments[0]:
        raise InputError("model.arguments.1", "is empty; the first argument names the executable")
    joined = "".join(section.arguments)
    for placeholder in ("{parameters}", "{results}"):
        if placeholder not in joined:
            raise InputError("model.arguments", f"{placeholder} is missing: it stands for a file that the command is given")
    limit = section.time_limit if section.time_limit is not None else math.inf
    return CommandTable(
        **common, **_plain(section, "format", "keep"), arguments=tuple(section.arguments), base=folder, time_limit=limit
    )


def _channels(tables: Mapping[str, schema.OutputTable], known: Mapping[str, str], path: str) -> Iterator[Channel]:
    """Mapped channels, whose units convert to those of levelone."""
    seen: dict[str, str] = {}
    for name, table in tables.items():
        if name not in known:
            raise unknown_name(path, name, known)
        other = seen.setdefault(table.name, name)
        if other != name:
            raise InputError(f"{path}.{name}.name", f"{table.name!r} is mapped as {other} already")
        scale = to_si(1.0, table.unit, known[name], f"{path}.{name}.unit")
        if not (math.isfinite(scale) and scale > 0.0):
            raise InputError(f"{path}.{name}.unit", f"{table.unit!r} is {scale:g} {known[name]}; must be finite and positive")
        trim = table.trim if isinstance(table, schema.InputTable) and table.trim != "hold" else None
        yield Channel(name, table.name, table.unit, scale, table.sign, None if trim is None else float(trim))


def _file(base: Path, given: str) -> Path:
    return _existing(base, given, "model.file", Path.is_file, "file")


def _folder(base: Path, given: str | None) -> Path | None:
    return None if given is None else _existing(base, given, "model.folder", Path.is_dir, "folder")


def _existing(base: Path, given: str, field: str, test: Any, what: str) -> Path:
    """Absolute path of a file or folder that the study names; InputError with the closest name beside it."""
    path = base / given
    try:
        if test(path):
            return path.resolve()
        beside = [each.name for each in islice(path.parent.iterdir(), _MOST_LISTED) if test(each)] if path.parent.is_dir() else []
    except (OSError, ValueError):  # a name that no file system takes
        beside = []
    hint = f"; {closest(path.name, beside)}" if beside else ""
    raise InputError(field, f"no such {what}: {path}{hint}")
