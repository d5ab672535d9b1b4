"""How far bandwidth and phase delay spread once the rotors' delay is held."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from levelone.report import symbols
from levelone.report.formatting import interval, number, percent
from levelone.report.pictures import Picture
from levelone.report.results import Results


def context(results: Results) -> dict[str, Any] | None:
    """The spread with and without the delay varied; None where the results hold no such sample."""
    given = results.summary.get("without_delay")
    if not given:
        return None
    rows = []
    for name, held in given["responses"].items():
        for text, sample in (("varied", results.responses[name]["monte_carlo"]), ("held", held)):
            rows.append(
                {"title": symbols.title(name), "symbol": symbols.html(name), "delay": text, **_spread(held["unit"], sample)}
            )
    held_at = f"{number(given['tau_d'])} s" if "tau_d" in given else ""
    return {"note": given.get("note", ""), "n": given["n"], "held_at": held_at, "rows": rows}


def pictures(results: Results) -> list[Picture]:
    """None: the table says it."""
    return []


def _spread(unit: str, sample: Mapping[str, Any]) -> dict[str, Any]:
    mean, std = float(sample["mean"]), float(sample["std"])
    return {
        "unit": unit, "mean": number(mean), "std": number(std, 3),
        "relative": percent(abs(std / mean) if mean else math.nan),
        "range": interval([sample["p05"], sample["p95"]], 4), "failed": f"{sample['failed']} of {sample['n']}",
    }  # fmt: skip
