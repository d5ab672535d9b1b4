"""Ranges of a study's factors over reduced frequency, written into a study file: comments and everything else stay as they are."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from levelone.aerodynamics.derivatives import Derivatives
from levelone.config.extends import ORIGIN, read_study
from levelone.config.files import PathOrName, read_text
from levelone.config.geometry_file import load_geometry
from levelone.config.study_file import Study, load_study
from levelone.config.study_schema import PARAMETERS
from levelone.config.table_writer import ZERO, provenance, write_checked
from levelone.errors import InputError
from levelone.vehicle import TARGET_UNITS, nominal_value

#: factor, and the motion, coefficient and part that it is read from: parts in q and in alphadot apart. Drag is left out, since that
#: of the lattice is induced drag alone, and C_Ybeta, which the flight model takes without the drag's part
APART = {
    "C_Lalpha": ("heave", "C_L", "in_phase"), "C_malpha": ("heave", "C_m", "in_phase"),
    "C_Lq": ("rate", "C_L", "quadrature"), "C_mq": ("rate", "C_m", "quadrature"),
    "C_Lalphadot": ("heave", "C_L", "quadrature"), "C_malphadot": ("heave", "C_m", "quadrature"),
    "C_lbeta": ("sideslip", "C_l", "in_phase"), "C_nbeta": ("sideslip", "C_n", "in_phase"),
    "C_Yp": ("roll", "C_Y", "quadrature"), "C_lp": ("roll", "C_l", "quadrature"), "C_np": ("roll", "C_n", "quadrature"),
    "C_Yr": ("yaw_rate", "C_Y", "quadrature"), "C_lr": ("yaw_rate", "C_l", "quadrature"),
    "C_nr": ("yaw_rate", "C_n", "quadrature"),
}  # fmt: skip
#: a pitch oscillation as it is: C_q and C_alphadot in one, as the published study takes them
LUMPED = {
    "C_Lalpha": ("pitch", "C_L", "in_phase"), "C_malpha": ("pitch", "C_m", "in_phase"),
    "C_Lq": ("pitch", "C_L", "quadrature"), "C_mq": ("pitch", "C_m", "quadrature"),
}  # fmt: skip
LAGS = ("C_Lalphadot", "C_malphadot")
#: what a new study does not take over from the one it extends: claims and tables about other ranges
WITHOUT = ("study.findings", "cases")


@dataclass(frozen=True)
class Span:
    """The values that a factor takes over reduced frequency, error bars included, and the vehicle's own value."""

    name: str
    low: float
    high: float
    nominal: float

    @property
    def outside(self) -> bool:
        """Whether the vehicle's own value is none of these."""
        return not self.low <= self.nominal <= self.high

    @property
    def range(self) -> tuple[float, float]:
        """Offsets from the vehicle's value to the ends of the smallest interval that holds it and the span."""
        low, high = min(self.low, self.nominal), max(self.high, self.nominal)
        return round(low - self.nominal, 6) + 0.0, round(high - self.nominal, 6) + 0.0


@dataclass(frozen=True)
class Written:
    """What was written: the file's text, its factors, and (name, why) of those that were left out."""

    text: str
    spans: tuple[Span, ...]
    left_out: tuple[tuple[str, str], ...]


def write_study(
    path: Path, found: Derivatives, geometry: PathOrName, extends: Path, *, lumped: bool = False, names: Sequence[str] = ()
) -> Written:
    """Write or update the [[factor]] blocks of a study file from derivatives over reduced frequency.

    Each block holds the vehicle's own value and the range in which the derivative lies over k, with its error bars. A vehicle's
    value outside is taken into the range, and the source says so: the nominal point is part of every study.

    Parameters
    ----------
    path
        A study file, whose other lines stay as they are; or a new one, which extends ``extends``.
    found, geometry
        Derivatives at two reduced frequencies or more, and the geometry (name or path) that they are of.
    extends
        Study that a new file extends; not looked at where ``path`` exists.
    lumped
        Write C_q + C_alphadot of the pitch oscillation as C_q, as the published study does, in place of both apart.
    names
        Factors that are wanted; all that the motions give if empty.

    Raises
    ------
    InputError
        Fewer than two k, motions that give none of the factors, a vehicle that would count the part in alphadot twice, a study file
        that does not load before or after; the file then stays as it was.
    """
    if len(found.k) < 2:
        raise InputError("k", f"{len(found.k)} value spans no range: give two or more")
    base = path if path.exists() else extends
    study = _study(base, path)
    spans, left_out = _spans(found, LUMPED if lumped else APART, study, names)
    if lumped:
        _require_no_lag(study)
    document = tomlkit.parse(read_text(path, path.name)) if path.exists() else _heir(path, extends, study)
    known = [dict(each) for each in read_study(base).content.get("factor", [])]
    source = f"{provenance(geometry, load_geometry(geometry))}, {len(found.k)} k from {min(found.k):g} to {max(found.k):g}"
    for span in spans:
        _put(document, span, known, f"{source}: {_words(span, lumped)}")
    text = tomlkit.dumps(document)
    write_checked(path, text, load_study)
    return Written(text, spans, left_out)


def _study(base: Path, path: Path) -> Study:
    if not base.is_file():
        raise InputError(str(path), f"is no study, and there is none to extend: no such file: {base}")
    return load_study(base)


def _spans(
    found: Derivatives, parts: Mapping[str, tuple[str, str, str]], study: Study, names: Sequence[str]
) -> tuple[tuple[Span, ...], tuple[tuple[str, str], ...]]:
    """Spans of the factors, and what is left out and why."""
    spans, left_out = [], []
    for name in names or parts:
        motion, coefficient, part = parts.get(name, ("", "", ""))
        if motion not in found.motions:
            left_out.append((name, f"needs the motion {motion}" if motion else "is not read from these oscillations"))
            continue
        low, high = _ends(found, motion, coefficient, part)
        if not math.isfinite(high - low):
            left_out.append((name, "is not finite at every k"))
        elif not high - low > ZERO:
            left_out.append((name, f"is {low:g} at every k: nothing of the geometry gives it"))
        else:
            spans.append(Span(name, low, high, nominal_value(study.vehicle, name, study.trim_speed)))
    if not spans or (names and left_out):
        why = "; ".join(f"{name} {reason}" for name, reason in left_out)
        raise InputError("factor", f"no range for what was asked: {why}")
    return tuple(spans), tuple(left_out)


def _ends(found: Derivatives, motion: str, coefficient: str, part: str) -> tuple[float, float]:
    """Lowest and highest value over k with the error bars (none where unknown), rounded outwards to four digits."""
    i, j = found.motions.index(motion), found.coefficients.index(coefficient)
    value, error = getattr(found, part)[i, :, j], np.nan_to_num(getattr(found, f"{part}_error")[i, :, j])
    low, high = float(np.min(value - error)), float(np.max(value + error))
    size = max(abs(low), abs(high))
    if not (math.isfinite(size) and size > ZERO):
        return low, high
    step = 10.0 ** (math.floor(math.log10(size)) - 3)
    # a value that is round but for its last bit stays what it is
    return float(f"{math.floor(low / step + 1e-6) * step:.10g}"), float(f"{math.ceil(high / step - 1e-6) * step:.10g}")


def _require_no_lag(study: Study) -> None:
    for name in LAGS:
        own = nominal_value(study.vehicle, name, study.trim_speed)
        if own != 0.0:
            raise InputError(name, f"is {own:g} in the vehicle {study.vehicle.name!r}: C_q of a pitch oscillation counts it again")
        if name in study.targets:
            raise InputError(f"factor.{name}", "is a factor of the study: C_q of a pitch oscillation counts it again; remove one")


def _words(span: Span, lumped: bool) -> str:
    what = f"{span.low:g} to {span.high:g}"
    if lumped and span.name.endswith("q"):
        what += ", C_q and C_alphadot of a pitch oscillation in one"
    return f"{what}; the vehicle's own {span.nominal:g} lies outside, and the range reaches to it" if span.outside else what


def _put(document: Any, span: Span, known: Sequence[Mapping[str, Any]], source: str) -> None:
    """Write one block, in place of the file's own for the same target; its name is that of the study's factor."""
    name = next((str(each["name"]) for each in known if each.get("target", each.get("name")) == span.name), span.name)
    if "factor" not in document:
        document["factor"] = tomlkit.aot()
    entry = next((each for each in document["factor"] if each.get("name") == name), None)
    if entry is None:
        entry = tomlkit.table()
        entry["name"] = name
        entry.trivia.indent = "\n"
        document["factor"].append(entry)
        kept = document["study"].get("factors")
        if kept is not None and name not in kept:
            kept.append(name)
    if name != span.name:
        entry["target"] = span.name
    numbers = {
        "value": span.nominal,
        "unit": TARGET_UNITS[span.name],
        "range": list(span.range),
        "kind": "absolute",
        "source": source,
    }
    for key in ("distribution", *PARAMETERS, *ORIGIN):
        if key in entry and key not in numbers:
            del entry[key]
    given = {each.get("distribution", "uniform") for each in known if each.get("name") == name}
    if given - {"uniform"}:
        # a factor with one unknown value stays one: its new range is no distribution either
        entry["distribution"] = "interval" if given & {"interval", "evidence"} else "uniform"
    for key, value in numbers.items():
        entry[key] = value


def _heir(path: Path, extends: Path, study: Study) -> Any:
    """A new study that extends another one."""
    content = read_study(extends).content
    name = path.stem if path.stem != "study" else path.resolve().parent.name
    document = tomlkit.parse("[study]\n")
    general: Any = document["study"]
    general["extends"] = Path(os.path.relpath(extends, path.parent)).as_posix()
    without = [each for each in WITHOUT if _has(content, each.split("."))]
    if without:
        general["without"] = without
    general["name"] = re.sub(r"^[^A-Za-z0-9]+|[^A-Za-z0-9._-]", "-", name).lstrip("-") or "k-dependent"
    general["title"] = f"{study.title}, with ranges over reduced frequency"
    return document


def _has(content: Mapping[str, Any], keys: Sequence[str]) -> bool:
    found: Any = content
    for key in keys:
        if not isinstance(found, Mapping) or key not in found:
            return False
        found = found[key]
    return True
