"""What is printed of imported results and of a comparison: columns by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Columns = dict[str, list[Any]]
#: block of a response's results -> indices that are printed, each with its interval
BLOCKS = {"morris": ("mu_star", "sigma"), "sobol": ("S1", "ST"), "given_data": ("S1",)}
BOTH = ("mu_star", "S1", "ST")


def response_table(results: Mapping[str, Any]) -> Columns:
    """One row for each response: runs that failed, statistics where the runs are a sample, and the status of its indices."""
    rows = results["responses"]
    out: Columns = {"response": list(rows), "failed": [str(row.get("failed", 0)) for row in rows.values()]}
    if any("monte_carlo" in row for row in rows.values()):
        for key in ("mean", "std", "p05", "p50", "p95"):
            out[key] = [row["monte_carlo"][key] for row in rows.values()]
    return out | {"indices": [row.get("status", "of Dakota alone") for row in rows.values()]}


def index_table(row: Mapping[str, Any]) -> Columns:
    """One row for each factor of one response: our indices with their intervals, and Dakota's; no columns where there are none."""
    out: Columns = {}
    for block, indices in BLOCKS.items():
        for index in indices if block in row else ():
            values = row[block].values()
            out["factor"] = list(row[block])
            out[index] = [each[index] for each in values]
            out[f"{index} low"], out[f"{index} high"] = ([each[f"{index}_ci"][end] for each in values] for end in (0, 1))
    if "dakota" in row:
        out["factor"] = list(row["dakota"])
        for index in next(iter(row["dakota"].values())):
            out[f"{index} (Dakota)"] = [each[index] for each in row["dakota"].values()]
    return out


def stage_table(content: Mapping[str, Any]) -> Columns:
    """Wall and processor time of each stage, s."""
    keys = {"stage": "stage", "wall": "wall s", "cpu": "CPU s", "wall_dakota": "wall s (Dakota)", "cpu_dakota": "CPU s (Dakota)"}
    return {title: [row[key] for row in content["stages"]] for key, title in keys.items()}


def comparison_table(content: Mapping[str, Any]) -> Columns:
    """One row for each response and factor, indices of both routes."""
    rows = [(name, factor, row) for name, each in content["responses"].items() for factor, row in each["factors"].items()]
    out: Columns = {"response": [name for name, _, _ in rows], "factor": [factor for _, factor, _ in rows]}
    for index in BOTH:
        out[index] = [row[index] for _, _, row in rows]
        out[f"{index}_low"], out[f"{index}_high"] = ([row[f"{index}_ci"][end] for _, _, row in rows] for end in (0, 1))
        out[f"{index}_dakota"] = [row[f"{index}_dakota"] for _, _, row in rows]
    return out


def agreement_table(content: Mapping[str, Any]) -> Columns:
    """One row for each response: how far the routes agree."""
    rows = content["responses"]
    out: Columns = {"response": list(rows)}
    out["Q2"] = [row["q2"] for row in rows.values()]
    out["failed"], out["failed (Dakota)"] = ([str(row[key]) for row in rows.values()] for key in ("failed", "failed_dakota"))
    out["ranks of mu_star"], out["ranks of ST"] = (
        [row["rank_agreement"][key] for row in rows.values()] for key in ("mu_star", "ST")
    )
    for index in ("S1", "ST"):
        out[f"largest {index} difference"] = [row["largest_difference"][index] for row in rows.values()]
    return out
