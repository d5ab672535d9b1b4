"""An assessment as JSON: SI and rad, undefined numbers NaN with a status, and where everything comes from."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from levelone import __version__
from levelone.campaign.assessment import Assessment
from levelone.campaign.assessment_compare import Comparison
from levelone.campaign.assessment_data import Loaded
from levelone.campaign.assessment_tests import NO_CHART, Reading
from levelone.handling import added_dynamics, mismatch
from levelone.handling.levels import Level
from levelone.status import Status

SCHEMA = 1
NAME = "assessment.json"
LEVEL_TEXT = {
    Level.UNDEFINED: "undefined", Level.OUTSIDE: "outside the requirement's range", Level.LEVEL_1: "Level 1",
    Level.LEVEL_2: "Level 2", Level.LEVEL_3: "Level 3",
}  # fmt: skip


def level_text(reading: Reading) -> str:
    """The Level in words; that no chart judges where none does."""
    if reading.chart == NO_CHART:
        return NO_CHART
    text = LEVEL_TEXT[Level(reading.level)]
    beyond = f" ({LEVEL_TEXT[Level(reading.level_extrapolated)]} by the extended boundary)"
    return text + beyond if reading.level == Level.OUTSIDE else text


def record_of(
    assessment: Assessment,
    loaded: Sequence[Loaded],
    reference: tuple[Assessment, Sequence[Loaded]] | None = None,
    comparison: Comparison | None = None,
) -> dict[str, Any]:
    """Everything that was found, and where it comes from."""
    content = {"schema": SCHEMA, "levelone": __version__, **_side(assessment, loaded)}
    if reference is not None and comparison is not None:
        content |= {"reference": _side(*reference), "comparison": _comparison(comparison)}
    return content


def write_record(folder: Path, content: Mapping[str, Any]) -> Path:
    """Write ``assessment.json`` in one move, so that no half-written file is ever seen; return its path."""
    path = folder / NAME
    part = path.with_suffix(".part")
    part.write_text(json.dumps(content, indent=1, allow_nan=True) + "\n", encoding="utf-8")
    os.replace(part, path)
    return path


def _side(assessment: Assessment, loaded: Sequence[Loaded]) -> dict[str, Any]:
    how = assessment.sweeping
    return {
        "kind": assessment.kind, "axis": assessment.axis, "input": assessment.input_name,
        "data": [_data(each, shape) for each, shape in zip(loaded, assessment.inputs, strict=True)],
        "sweep": {} if how is None else {
            "omega_min": how.omega_min, "omega_max": how.omega_max, "windows": list(how.windows),
            "response_type": how.response_type, "phase_reference": how.phase_reference, "task": how.task,
        },
        "boundaries": {"name": assessment.boundaries.name, "source": assessment.boundaries.source},
        "readings": [_reading(each) for each in assessment.readings],
        "unread": [{"criterion": each.criterion, "why": each.why} for each in assessment.unread],
        "checks": list(assessment.checks),
        "responses": {key: _response(each) for key, each in assessment.responses.items()},
    }  # fmt: skip


def _data(each: Loaded, shape: Any) -> dict[str, Any]:
    table = each.table
    return {
        "file": str(each.file.path), "sha256": each.file.sha256, "format": each.file.kind, "samples": int(table.time.size),
        "from": float(table.time[0]), "to": float(table.time[-1]), "interval": table.dt, "largest_gap": table.largest_gap,
        "resampled": table.resampled, "notes": list(table.notes), "assumed_si": each.assumed_units,
        "columns": {
            name: {"column": source.name, "unit": table.units.get(name, ""), "factor": source.factor, "offset": source.offset}
            for name, source in table.sources.items()
        },
        "input": {
            "kind": shape.kind, "moves": shape.moves, "on": shape.on, "off": shape.off, "returns_in": shape.returns_in,
            "before": shape.before, "size": shape.size, "changes_of_side": shape.turns,
        },
    }  # fmt: skip


def _reading(each: Reading) -> dict[str, Any]:
    return {
        "criterion": each.criterion, "title": each.title, "axis": each.axis, "record": each.record,
        "values": {
            one.name: {
                "value": one.value, "unit": one.unit, "std": one.error, "half_width_95": one.half_width, "status": one.text,
            }
            for one in each.values
        },
        "level": int(each.level), "level_text": level_text(each), "level_extrapolated": int(each.level_extrapolated),
        "chart": each.chart, "verified": each.verified, "times": dict(each.times), "remarks": list(each.remarks),
    }  # fmt: skip


def _response(each: Any) -> dict[str, Any]:
    found = each.identified
    value, coherence = found.response.value, found.response.coherence
    return {
        "title": each.title, "unit": each.unit, "omega": _list(found.response.omega), "re": _list(value.real),
        "im": _list(value.imag), "coherence": _list(coherence), "std": _list(found.error), "averages": _list(found.averages),
        "records": [Status(int(code)).text for code in found.status],
    }  # fmt: skip


def _comparison(found: Comparison) -> dict[str, Any]:
    return {
        "mean_cost": found.cost, "verdict": found.verdict,
        "formula": {
            "cost": {"confidence": mismatch.CONFIDENCE, "source": mismatch.SOURCE},
            "envelopes": {"confidence": added_dynamics.CONFIDENCE, "source": added_dynamics.SOURCE},
        },
        "responses": [
            {
                "key": each.key, "title": each.title, "cost": each.mismatch.cost, "gain_part": each.mismatch.gain_part,
                "phase_part": each.mismatch.phase_part, "verdict": each.mismatch.verdict, "frequencies": each.mismatch.used,
                "unnoticeable_share": each.share, "unnoticeable": each.noticed, "unnoticeable_frequencies": each.read,
            }
            for each in found.responses
        ],
        "metrics": [
            {
                "criterion": pair.flight.criterion, "title": pair.flight.title, "simulation_record": pair.simulation.record,
                "flight_record": pair.flight.record, "name": row.name, "simulation": row.simulation, "flight": row.flight,
                "difference": row.difference, "allowed": row.allowed, "verdict": row.verdict,
                "paragraph": "" if row.tolerance is None else row.tolerance.paragraph,
                "confidence": "" if row.tolerance is None else row.tolerance.confidence,
            }
            for pair in found.pairs
            for row in pair.rows
        ],
        "unpaired": list(found.unpaired),
    }  # fmt: skip


def _list(values: Any) -> list[float]:
    return [value if math.isfinite(value) else math.nan for value in np.asarray(values, dtype=np.float64).tolist()]
