"""The [aerodynamics] section of a vehicle file, written from a table of coefficients with their origins and error bars."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from levelone._version import __version__
from levelone.aerodynamics.geometry import Geometry
from levelone.config.files import PathOrName, file_hash, read_text, read_toml
from levelone.config.geometry_file import geometry_path
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError
from levelone.vehicle import COEFFICIENTS, TARGET_UNITS

SECTION = "aerodynamics"
#: digits that are written: more than any error bar supports, few enough to be read
DIGITS = 6
#: values below are rounding of zero
ZERO = 1e-9


@dataclass(frozen=True)
class Coefficient:
    """One coefficient, constant or for each airspeed.

    Parameters
    ----------
    value
        One number, or one for each airspeed of the table.
    error
        Half-widths of the error bars, as many; NaN where there is none.
    source, assumed
        Where it comes from, or why it is assumed: exactly one of them.
    """

    value: tuple[float, ...]
    error: tuple[float, ...]
    source: str | None = None
    assumed: str | None = None


@dataclass(frozen=True)
class CoefficientTable:
    """Coefficients under the names, axes and signs of a vehicle file.

    Parameters
    ----------
    area, chord, span
        Reference area (m^2) and lengths (m), known without error.
    moment_reference
        The point that moments are about, in words.
    airspeed, k
        [n] m/s, increasing, and the reduced frequency omega c/(2V) at each; empty where no coefficient changes with airspeed.
    coefficients
        Name (of ``levelone.vehicle.COEFFICIENTS``) to its numbers.
    missing
        (name, why) of coefficients that are not known: the section does not give them, and a vehicle without them does not load.
    notes
        What holds for the whole table.
    """

    area: Coefficient
    chord: Coefficient
    span: Coefficient
    moment_reference: str
    airspeed: tuple[float, ...]
    k: tuple[float, ...]
    coefficients: Mapping[str, Coefficient]
    missing: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def provenance(path_or_name: PathOrName, geometry: Geometry) -> str:
    """Version, geometry with the first digits of its file's SHA-256, and grid, for the origin of what is computed from it."""
    panels = " + ".join(f"{surface.chordwise} x {surface.strips}" for surface in geometry.surfaces)
    sha = file_hash(geometry_path(path_or_name))[:12]
    return f"levelone {__version__}, geometry {geometry.name} ({sha}), {panels} panels and finer, extrapolated"


def rounded(value: float) -> float:
    """The number as it is written; rounding of zero becomes zero."""
    return 0.0 if abs(value) < ZERO else float(f"{value:.{DIGITS}g}")


def table_text(table: CoefficientTable) -> str:
    """The section as TOML; errors of the values are comments behind them."""
    lines = [f"[{SECTION}]", *(_comment(note) for note in table.notes), _entry("moment_reference", _toml(table.moment_reference))]
    for name, unit in (("area", "m^2"), ("chord", "m"), ("span", "m")):
        lines.append(_coefficient(name, getattr(table, name), unit))
    if table.airspeed:
        k = ", ".join(f"{each:.4g}" for each in table.k)
        lines.append(_quantity("airspeed", list(table.airspeed), "m/s", {"source": f"speeds asked for; k = omega c/(2V): {k}"}))
    for name in COEFFICIENTS:
        if name in table.coefficients:
            lines.append(_coefficient(name, table.coefficients[name], TARGET_UNITS[name]))
    lines += [_comment(f"{name} is missing: {why}") for name, why in table.missing]
    return "\n".join(lines) + "\n"


def write_table(table: CoefficientTable, path: Path | None = None) -> str:
    """The section as TOML, and a file of it.

    Parameters
    ----------
    table
        The coefficients.
    path
        None: nothing is written. A new file: the section alone, to be put into a vehicle file. A vehicle file: its section is
        replaced; of the old one only what the table does not give stays (derivatives of control surfaces, coefficients that are
        missing), and the file is left as it was if the new one is no vehicle.

    Raises
    ------
    InputError
        A file that is no vehicle file, cannot be written, or would no longer load: with what is missing or wrong.
    """
    text = table_text(table)
    if path is not None:
        replaced = _replaced(path, text, table) if path.exists() else text
        write_checked(path, replaced, load_vehicle if path.exists() else read_toml)
    return text


def write_checked(path: Path, text: str, check: Callable[[Path], object]) -> None:
    """Write a file beside the old one, and put it in its place only if ``check`` takes it.

    Raises
    ------
    InputError
        What ``check`` says, under the file's own name; or the file cannot be written.
    """
    draft = path.with_name(f".{path.stem}.draft{path.suffix}")
    try:
        draft.write_text(text, encoding="utf-8", newline="\n")
        check(draft)
        os.replace(draft, path)
    except InputError as error:
        raise InputError(error.field.replace(draft.name, path.name), error.problem) from None
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from None
    finally:
        draft.unlink(missing_ok=True)


def _replaced(path: Path, text: str, table: CoefficientTable) -> str:
    """A vehicle file's text with its section replaced."""
    document = tomlkit.parse(read_text(path, path.name)) if read_toml(path) else tomlkit.document()
    if SECTION not in document or "vehicle" not in document:
        raise InputError(path.name, f"is no vehicle file with a section [{SECTION}]: its coefficients cannot be replaced")
    old: Any = document[SECTION]
    new: Any = tomlkit.parse(text)[SECTION]
    kept = dict(_kept(old, set(new), table))
    if any("source" not in entry and "assumed" not in entry for entry in kept.values()):
        kept = {key: old[key] for key in ("source", "assumed") if key in old} | kept
    for key, entry in kept.items():
        new[key] = entry
    new.add(tomlkit.nl())
    document[SECTION] = new
    return tomlkit.dumps(document)


def _kept(old: Any, given: set[str], table: CoefficientTable) -> Iterator[tuple[str, Any]]:
    """Coefficients of the old section that the new one does not give; a schedule must fit the new airspeeds."""
    speeds = list(old["airspeed"]["value"]) if "airspeed" in old else []
    for key in old:
        if key not in COEFFICIENTS or key in given:
            continue
        if isinstance(old[key]["value"], list) and speeds != list(table.airspeed):
            raise InputError(
                f"{SECTION}.{key}", "is a schedule over other airspeeds than the new table's: give it as a number first"
            )
        yield key, old[key]


def _coefficient(name: str, given: Coefficient, unit: str) -> str:
    values = [rounded(each) for each in given.value]
    errors = [f"{each:.2g}" if math.isfinite(each) else "unknown" for each in given.error]
    constant = len(set(values)) == 1
    origin = {key: text for key in ("source", "assumed") if (text := getattr(given, key)) is not None}
    line = _quantity(name, values[0] if constant else values, unit, origin)
    known = any(each > 0.0 for each in given.error) and any(values)
    return f"{line} # +- {', '.join(errors[:1] if constant else errors)}" if known else line


def _quantity(name: str, value: Any, unit: str, origin: Mapping[str, str]) -> str:
    entries = {"value": value, "unit": unit, **origin}
    return _entry(name, f"{{ {', '.join(_entry(key, _toml(each)) for key, each in entries.items())} }}")


def _comment(text: str) -> str:
    """A comment of one line, whatever the text holds."""
    return f"# {' '.join(text.split())}"


def _entry(name: str, text: str) -> str:
    return f"{name} = {text}"


def _toml(value: Any) -> str:
    return tomlkit.item(value).as_string()
