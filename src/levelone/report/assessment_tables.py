"""Rows of the page of an assessment, as text in the units of the field."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from levelone.campaign.assessment import Assessment
from levelone.campaign.assessment_compare import Comparison, Pair
from levelone.campaign.assessment_data import Loaded
from levelone.campaign.assessment_record import level_text
from levelone.campaign.assessment_tests import Reading, Value
from levelone.handling import added_dynamics, mismatch
from levelone.handling.added_dynamics import POINTS
from levelone.handling.levels import Chart, DampingLimits
from levelone.report import symbols
from levelone.report.formatting import UNDEFINED, number, percent
from levelone.status import Status

_TITLES = {
    "height_response": "Height response",
    "large_amplitude": "Large-amplitude response",
}
_WORDS = {
    "quickness": "quickness", "damped_period": "damped period", "peak_ratio": "valley over peak", "ratio": "ratio of peaks",
    "ratio_literal": "ratio to the change at 4 s", "off_axis_peak": "off-axis peak", "on_axis_peak": "on-axis peak",
    "settling_time": "settling time", "r2": Markup("<i>r</i>²"),
}  # fmt: skip
_UNITS = {"rad": (180.0 / math.pi, "deg"), "rad/s": (1.0, "rad/s"), "1": (1.0, "")}
_ENDS_OF_RATES = ("_pk", "_largest", "_required")
"""Ends of names of angular rates that the field reads in deg/s; frequencies stay in rad/s."""


def criterion_title(criterion: str) -> str:
    """A criterion in words."""
    return symbols.CRITERION_TITLES.get(criterion, _TITLES.get(criterion, criterion))


def chart_words(chart: Chart | DampingLimits) -> str:
    """How far the boundaries of a figure are confirmed."""
    return "Boundaries confirmed." if chart.verified else "Dash-dotted boundaries are unverified."


def reading_rows(assessment: Assessment) -> list[dict[str, Any]]:
    """A row for each reading: its values with their errors, its Level, and what keeps a value from being read."""
    return [
        {
            "criterion": criterion_title(each.criterion), "title": each.title, "record": each.record,
            "values": [value_cell(value) for value in each.values],
            "level": level_text(each), "unverified": not each.verified and level_text(each).startswith(("Level", "outside")),
            "why": [*_reasons(each), *map(_sentence, each.remarks)],
        }
        for each in assessment.readings
    ]  # fmt: skip


def value_cell(value: Value) -> dict[str, Any]:
    """Symbol, number with its 95 % interval, and unit of one value."""
    scale, unit = field_unit(value)
    text = number(scale * value.value)
    if math.isfinite(value.value) and math.isfinite(value.half_width):
        text = f"{text} ± {number(scale * value.half_width, 2)}"
    return {"symbol": symbol(value.name), "text": text, "unit": unit if text != UNDEFINED else ""}


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def field_unit(value: Value) -> tuple[float, str]:
    """Factor from SI to what the field reads, and its name."""
    if value.unit == "rad/s" and value.name.endswith(_ENDS_OF_RATES):
        return 180.0 / math.pi, "deg/s"
    return _UNITS.get(value.unit, (1.0, value.unit))


def symbol(name: str) -> Markup | str:
    """A value's symbol, or what it is called where it has none; quickness and coupling are read on every axis."""
    return _WORDS[name] if name in _WORDS else symbols.html(name)


def _reasons(each: Reading) -> list[Markup]:
    """Why values are undefined or to be taken with care, each reason once with the values it holds for."""
    reasons: dict[str, list[str]] = {}
    for value in each.values:
        if value.status != Status.OK:
            reasons.setdefault(value.text, []).append(value.name)
    return [Markup("{}: {}.").format(Markup(", ").join(map(symbol, names)), text) for text, names in reasons.items()]


def sweep_words(assessment: Assessment) -> dict[str, Any]:
    """How sweeps were identified; empty for steps and pulses."""
    how = assessment.sweeping
    if how is None:
        return {}
    averages = [each.identified.averages for each in assessment.responses.values()]
    least = min((float(each.min()) for each in averages), default=math.nan)
    return {
        "range": f"{number(how.omega_min, 3)} to {number(how.omega_max, 3)} rad/s",
        "windows": ", ".join(number(each, 3) for each in how.windows), "averages": number(least, 3),
        "type": how.response_type.replace("_", " "), "task": how.task.replace("_", " "),
        "reference": number(math.degrees(how.phase_reference), 3),
    }  # fmt: skip


def file_rows(loaded: Sequence[Loaded], assessment: Assessment, side: str = "") -> list[dict[str, Any]]:
    """A row for each file: content, sampling, input as recognised, and what was done to it."""
    rows = []
    for each, shape in zip(loaded, assessment.inputs, strict=True):
        table = each.table
        end = "" if math.isnan(shape.off) else f", ends {shape.off:.3f} s"
        notes = list(table.notes)
        if each.assumed_units:
            notes.append(f"no unit stated, SI and rad taken: {', '.join(each.assumed_units)}")
        rows.append({
            "name": each.record.name, "side": side, "file": each.file.path.name, "format": each.file.kind,
            "hash": each.file.sha256[:16], "samples": f"{table.time.size}", "rate": number(1.0 / table.dt, 5),
            "time": f"{table.time[0]:.2f} to {table.time[-1]:.2f}", "gap": number(1e3 * table.largest_gap, 3),
            "input": f"{shape.kind}, begins {shape.on:.3f} s{end}", "notes": notes,
        })  # fmt: skip
    return rows


def mapping_rows(loaded: Sequence[Loaded]) -> list[dict[str, str]]:
    """A row for each channel, once for all files that take it from the same column."""
    rows: dict[tuple[str, str, str, str], dict[str, str]] = {}
    for each in loaded:
        for name, source in each.table.sources.items():
            unit = each.table.units[name]
            factor = f"× {number(source.factor, 6)}" if source.factor != 1.0 else ""
            shift = f" + {number(source.offset, 6)}" if source.offset else ""
            key = (name, source.name, unit, factor + shift)
            rows.setdefault(key, {"channel": name, "column": source.name, "unit": unit or "SI taken", "change": factor + shift})
    return list(rows.values())


def comparison_rows(found: Comparison | None) -> dict[str, Any]:
    """Simulation against flight: responses and metrics; empty without a reference."""
    if found is None:
        return {}
    return {
        "cost": number(found.cost, 3), "verdict": found.verdict, "unpaired": found.unpaired,
        "sources": [(mismatch.SOURCE, mismatch.CONFIDENCE), (added_dynamics.SOURCE, added_dynamics.CONFIDENCE)],
        "responses": [
            {
                "title": each.title, "cost": number(each.mismatch.cost, 3), "gain": number(each.mismatch.gain_part, 3),
                "phase": number(each.mismatch.phase_part, 3), "verdict": each.mismatch.verdict, "share": percent(each.share),
                "noticed": each.noticed, "read": f"{each.read} of {POINTS}",
                "range": "" if each.added is None else " to ".join(number(each.added.error.omega[end], 3) for end in (0, -1)),
            }
            for each in found.responses
        ],
        "pairs": [_pair(each) for each in found.pairs],
    }  # fmt: skip


def _pair(pair: Pair) -> dict[str, Any]:
    rows = []
    for row in pair.rows:
        one, other = pair.simulation.value(row.name), pair.flight.value(row.name)
        scale, unit = field_unit(other)
        paragraph = "" if row.tolerance is None else row.tolerance.paragraph
        unsure = row.tolerance is not None and row.tolerance.confidence != "high"
        rows.append({
            "symbol": symbol(row.name), "simulation": value_cell(one)["text"], "flight": value_cell(other)["text"], "unit": unit,
            "difference": number(scale * row.difference, 3),
            "allowed": f"± {number(scale * row.allowed, 3)}" if math.isfinite(row.allowed) else "",
            "verdict": row.verdict + (" (unverified tolerance)" if unsure else ""), "paragraph": paragraph,
        })  # fmt: skip
    return {
        "criterion": criterion_title(pair.flight.criterion), "title": pair.flight.title,
        "record": f"{pair.simulation.record}, {pair.flight.record}", "rows": rows,
    }  # fmt: skip
