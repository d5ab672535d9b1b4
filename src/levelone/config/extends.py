"""Study files that extend one another: the content of the whole chain, and in which file each value stands."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

from levelone.config.files import file_hash, joint_hash, read_toml
from levelone.config.schema import check, in_file
from levelone.config.study_schema import PARAMETERS, Heir, Inheritance, StudyFile
from levelone.errors import InputError, unknown_name

Table = dict[str, Any]
PATHS = (("study", "vehicle"), ("study", "findings"), ("levels", "boundaries"))
"""Entries that are paths where they end in .toml, relative to the file that they stand in."""
OWN = tuple(Inheritance.model_fields)
"""Keys of [study] that are about one file and are not inherited."""
ORIGIN = ("source", "assumed")
MEANING = ("distribution", "unit", "target")
"""Keys of a factor that give its parameters their meaning."""


@dataclass(frozen=True, eq=False)
class StudySource:
    """Content of a study file after merging.

    Parameters
    ----------
    path, name
        The file that was asked for, and its name for errors.
    files
        That file, the one it extends, and so on.
    content
        As TOML gives it; paths are absolute or relative to the working directory.
    owners
        Dotted path of a value or table to the name of the file that gives it.
    """

    path: Path
    name: str
    files: tuple[Path, ...]
    content: Table
    owners: Mapping[str, str]

    @property
    def hash(self) -> str:
        """SHA-256 of the file; of all the files of the chain where there are several."""
        return file_hash(self.path) if len(self.files) == 1 else joint_hash(self.files)

    def file_of(self, field: str) -> str:
        """Name of the file in which a field stands: of its innermost part that some file gives, else of the file asked for."""
        parts = field.split(".")
        paths = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
        return next((self.owners[path] for path in paths if path in self.owners), self.name)

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Put before the field of an error the name of the file that it stands in."""
        try:
            yield
        except InputError as error:
            if error.field == self.name:
                raise
            field = error.field.removeprefix(f"{self.name}: ")
            raise InputError(f"{self.file_of(field)}: {field}", error.problem) from None

    def checked(self) -> StudyFile:
        """The content as checked sections."""
        with self.blamed():
            return check(StudyFile, self.content, self.name)


def read_study(path: Path) -> StudySource:
    """Read a study file and all that it extends, and merge them.

    Tables merge key by key, [[factor]] entries by name, anything else is replaced: other lists, and a quantity with its unit and
    origin as a whole. A factor that is given another distribution, unit or target loses its inherited parameters, and one that
    is given other parameters the source of those it had.

    Raises
    ------
    InputError
        A file that is missing or is no TOML file, files that extend one another in a circle, a name to leave out or to keep that
        is not there, a study without a name of its own.
    """
    return _read(path, path.name, ())


def _read(path: Path, name: str, above: tuple[Path, ...]) -> StudySource:
    content = _anchored(_content(path, name), path.parent)
    heir = check(Heir, content, name).study
    chain = (*above, path)
    files: tuple[Path, ...] = ()
    owners: Mapping[str, str] = {}
    base = None if heir.extends is None else _base(path.parent / heir.extends, name, heir.extends, chain)
    if base is not None:
        merged = _merged(base.content, content, name, heir.without)
        files, left = base.files, set(_paths(merged))
        owners = {path: file for path, file in base.owners.items() if path in left}
    elif heir.without:
        raise InputError(f"{name}: study.without", "there is nothing to leave out: this file extends no other")
    else:
        merged = content
    if heir.factors is not None:
        _keep(merged, heir.factors, name)
    return StudySource(path, name, (path, *files), merged, {**owners, **dict.fromkeys(_paths(content), name)})


def _content(path: Path, name: str) -> Table:
    try:
        return read_toml(path)
    except InputError as error:
        raise InputError(name, error.problem) from None


def _base(path: Path, name: str, given: str, chain: tuple[Path, ...]) -> StudySource:
    """The file that another one extends; errors call it by its path from the file that was asked for."""
    if path.resolve() in [each.resolve() for each in chain]:
        raise InputError(f"{name}: study.extends", f"{given!r} leads back to a file that extends it: {_circle(chain, path)}")
    if not path.is_file():
        raise InputError(f"{name}: study.extends", f"no such file: {path}")
    shown = Path(os.path.normpath(os.path.join(os.path.dirname(name), given))).as_posix()
    return _read(path, shown, chain)


def _circle(chain: tuple[Path, ...], path: Path) -> str:
    return " -> ".join("/".join(each.resolve().parts[-2:]) for each in (*chain, path))


def _anchored(content: Table, folder: Path) -> Table:
    """The content with paths that no longer depend on where the file is."""
    out = dict(content)
    for section, key in PATHS:
        table = out.get(section)
        if isinstance(table, dict) and isinstance(value := table.get(key), str) and value.endswith(".toml"):
            out[section] = table | {key: str(folder / value)}
    return out


def _merged(base: Table, own: Table, name: str, without: list[str]) -> Table:
    kept = base
    for i, path in enumerate(without, 1):
        kept = _left_out(kept, path.split("."), f"{name}: study.without.{i}")
    general = kept.get("study", {})
    if own["study"].get("name", general.get("name")) == general.get("name"):
        raise InputError(f"{name}: study.name", "a study that extends another needs a name of its own: it is its folder of results")
    kept = kept | {"study": {key: value for key, value in general.items() if key not in OWN}}
    with in_file(name):
        return _joined(kept, own)


def _left_out(table: Table, path: list[str], field: str, above: str = "") -> Table:
    """The table without the entry at a path."""
    key, *rest = path
    inner = table.get(key)
    if key not in table or (rest and not isinstance(inner, dict)):
        raise unknown_name(field, ".".join((above + key, *rest)), [above + each for each in table])
    others = {each: value for each, value in table.items() if each != key}
    return others | {key: _left_out(inner, rest, field, f"{above}{key}.")} if isinstance(inner, dict) and rest else others


def _joined(base: Table, own: Table, top: bool = True) -> Table:
    out = dict(base)
    for key, value in own.items():
        old = base.get(key)
        if top and key == "factor" and _are_tables(value) and _are_tables(old):
            out[key] = _factors(old, value)
        elif isinstance(value, dict) and isinstance(old, dict) and "value" not in value:
            out[key] = _joined(old, value, top=False)
        else:
            out[key] = value
    return out


def _are_tables(value: Any) -> TypeGuard[list[Table]]:
    return isinstance(value, list) and value != [] and all(isinstance(each, dict) for each in value)


def _factors(base: list[Table], own: list[Table]) -> list[Table]:
    names = [table.get("name") for table in own]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"factor.{twice}", "given twice in this file")
    given = dict(zip(names, own, strict=True))
    old = [table.get("name") for table in base]
    merged = [_factor(table, given[name]) if name in given else table for name, table in zip(old, base, strict=True)]
    return merged + [table for name, table in given.items() if name not in old]


def _factor(base: Table, own: Table) -> Table:
    """One factor given again: what it no longer is does not stay behind."""
    defaults = {"distribution": "uniform", "target": base.get("name")}
    changed = any(key in own and own[key] != base.get(key, defaults.get(key)) for key in MEANING)
    dropped: tuple[str, ...] = PARAMETERS if changed else ()
    if changed or any(key in own for key in (*PARAMETERS, *ORIGIN)):
        dropped += ORIGIN
    return {key: value for key, value in base.items() if key not in dropped} | own


def _keep(content: Table, names: list[str], name: str) -> None:
    """Only the factors that are named, in the order that they had."""
    factors = content.get("factor")
    if not _are_tables(factors):
        return  # the check of the sections says what is wrong with them
    known = [str(table.get("name")) for table in factors]
    for i, each in enumerate(names, 1):
        if each not in known:
            raise unknown_name(f"{name}: study.factors.{i}", each, known)
    content["factor"] = [table for table in factors if table.get("name") in names]


def _paths(table: Table, above: str = "") -> Iterator[str]:
    """Paths of the values of a table, and of the tables that hold values themselves; entries of lists go by their name."""
    for key, value in table.items():
        path = f"{above}{key}"
        if isinstance(value, dict):
            if any(not isinstance(each, dict) for each in value.values()):
                yield path
            yield from _paths(value, f"{path}.")
        elif _are_tables(value):
            for i, each in enumerate(value, 1):
                entry = f"{path}.{each.get('name', i)}"
                yield entry
                yield from _paths(each, f"{entry}.")
        else:
            yield path
