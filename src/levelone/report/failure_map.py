"""Where in the factor box evaluations failed: counts by outcome, the plane that separates them best, and each factor alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from levelone.report import style, symbols
from levelone.report.formatting import number, percent
from levelone.report.pictures import Picture
from levelone.report.results import Results

#: p-value above which failures are not called gathered
CHANCE = 0.05
QUARTERS = ("lowest quarter", "second quarter", "third quarter", "highest quarter")
#: colour and mark of the outcomes, the most frequent first; what comes after them shares the last
_LOOKS = (
    (style.VERMILLION, "X"),
    (style.BLUE, "^"),
    (style.PURPLE, "s"),
    (style.ORANGE, "D"),
    (style.GREEN, "v"),
    (style.BLACK, "*"),
)
_ROW = 0.17
"""in: height of one factor's strip."""
_LONGEST = 18


def context(results: Results) -> dict[str, Any] | None:
    """Counts, factors and the pair as text; None where the results hold no map."""
    found = results.summary.get("failure_map")
    if not found:
        return None
    runs, failed = found["runs"], found["failed"]
    text: dict[str, Any] = {"runs": runs, "failed": failed, "share": percent(failed / runs) if runs else ""}
    if not failed:
        return text
    return text | {
        "outcomes": [{**row, "responses": _responses(row)} for row in found["outcomes"]],
        "factors": [_factor(row) for row in found["factors"]],
        "quarters": QUARTERS,
        "pair": _pair(found["pair"], failed) if "pair" in found else None,
    }


def pictures(results: Results) -> list[Picture]:
    """The map; none where nothing failed."""
    found = results.summary.get("failure_map")
    if not found or not found["failed"]:
        return []
    plane = "In the plane of the two factors that separate them best: evaluations that failed, over those that did not (dots). "
    strips = (
        "Positions of the failed evaluations in the range of each factor, from its lowest to its highest value (quarters of its "
        "distribution; the darker, the larger the share that failed there)."
    )
    of = found["shown"]["of"]
    shown = found["shown"]["outcome"]
    less = len(shown) < sum(of)
    part = f" Shown: {len(found['shown']['positions'])} of {of[0]} failed, {shown.count('ok')} of {of[1]} others." if less else ""
    caption = f"{plane if 'pair' in found else ''}{strips}{part}"
    return [Picture("failure_map", "failure_map", caption, True, partial(draw, found))]


def draw(found: Mapping[str, Any]) -> Figure:
    """The plane of the pair, where there is one, beside the strips of all factors."""
    looks = _looks(found)
    names = [row["factor"] for row in found["factors"]]
    height = max(2.9 if "pair" in found else 0.0, _ROW * len(names) + 0.9)
    two = "pair" in found
    beside = 0.35 + 0.055 * max(len(_short(name)) for name in names)
    margins = style.Margins(
        left=0.62 if two else beside, bottom=0.4, top=0.2 + 0.16 * -(-(len(looks) + two) // 5), beside=beside + 0.1
    )
    figure, axes = style.sheet(style.PAGE, height, 1, 2 if two else 1, margins=margins)
    if two:
        _plane(axes[0, 0], found["shown"], looks)
    _strips(axes[0, -1], found, looks)
    handles = [
        Line2D([], [], linestyle="none", marker=mark, color=colour, markersize=4, label=name)
        for name, (colour, mark) in looks.items()
    ]
    if two:
        handles.append(Line2D([], [], linestyle="none", marker=".", color=style.FAINT, markersize=4, label="ok"))
    style.key(figure, handles, columns=min(len(handles), 5))
    return figure


def _looks(found: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Name of each outcome to its colour and mark."""
    last = len(_LOOKS) - 1
    return {row["name"]: _LOOKS[min(i, last)] for i, row in enumerate(found["outcomes"])}


def _plane(panel: Axes, shown: Mapping[str, Any], looks: Mapping[str, tuple[str, str]]) -> None:
    x, y, outcome = np.array(shown["x"]), np.array(shown["y"]), np.array(shown["outcome"])
    good = outcome == "ok"
    panel.plot(x[good], y[good], ".", color=style.FAINT, markersize=2.5, markeredgewidth=0.0, zorder=1)
    # the rarest last, so that it is not covered
    for name, (colour, mark) in looks.items():
        mine = outcome == name
        panel.plot(x[mine], y[mine], mark, color=colour, markersize=4, markeredgecolor="white", markeredgewidth=0.3, zorder=2)
    panel.set_xlabel(_label(shown, 0))
    panel.set_ylabel(_label(shown, 1))
    style.grid(panel)


def _label(shown: Mapping[str, Any], which: int) -> str:
    unit = shown["units"][which]
    name = symbols.mathtext(shown["factors"][which])
    return name if unit in ("", "1") else f"{name}, {unit.replace('$', '')}"


def _strips(panel: Axes, found: Mapping[str, Any], looks: Mapping[str, tuple[str, str]]) -> None:
    """One row a factor, the one with the least p-value on top."""
    rows, shown = found["factors"], found["shown"]
    positions = np.array(shown["positions"])
    outcome = np.array(shown["outcome"][: len(positions)])
    column = {name: j for j, name in enumerate(shown["order"])}
    most = max(max(_shares(row)) for row in rows)
    for place, row in enumerate(rows):
        for quarter, share in enumerate(_shares(row)):
            shade = str(1.0 - 0.25 * share / most)
            panel.add_patch(Rectangle((quarter / 4, place - 0.42), 0.25, 0.84, facecolor=shade, edgecolor="none", zorder=0))
        spread = (len(looks) - 1) * 0.5
        for level, (name, (colour, mark)) in enumerate(looks.items()):
            x = positions[outcome == name, column[row["factor"]]]
            y = np.full(x.size, place + (level - spread) * 0.6 / max(len(looks), 1))
            panel.plot(x, y, mark, color=colour, markersize=2.6, markeredgewidth=0.0, alpha=0.35 if len(positions) > 150 else 0.8)
    panel.set_xlim(0.0, 1.0)
    panel.set_ylim(len(rows) - 0.5, -0.5)
    panel.set_yticks(range(len(rows)), [symbols.mathtext(_short(row["factor"])) for row in rows])
    panel.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0])
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("position in the range of the factor")


def _short(name: str) -> str:
    """A name that fits beside its strip: of a path, its end."""
    return name if len(name) <= _LONGEST else f"…{name[1 - _LONGEST :]}"


def _shares(row: Mapping[str, Any]) -> list[float]:
    return [failed / runs if runs else 0.0 for failed, runs in zip(row["failed"], row["runs"], strict=True)]


def _responses(row: Mapping[str, Any]) -> str:
    return "all" if row["all_responses"] == row["evaluations"] else ", ".join(row["responses"])


def _factor(row: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "symbol": symbols.html(row["factor"]), "mean_failed": number(row["mean_failed"], 2), "mean_all": number(row["mean_all"], 2),
        "p_value": _p(row["p_value"]), "strong": row["p_value"] < CHANCE,
        "quarters": [f"{failed} of {runs}" for failed, runs in zip(row["failed"], row["runs"], strict=True)],
    }  # fmt: skip


def _p(value: float) -> str:
    return "< 0.001" if value < 0.001 else number(value, 2)


def _pair(pair: Mapping[str, Any], failed: int) -> dict[str, Any]:
    """The plane in words: whether it separates, and its worst cells."""
    counts, runs = np.array(pair["failed"]), np.array(pair["runs"])
    order: Sequence[int] = np.argsort(-counts.ravel(), kind="stable")[:3].tolist()
    cells = [
        {"first": QUARTERS[at // 4], "second": QUARTERS[at % 4], "failed": int(counts.flat[at]), "runs": int(runs.flat[at]),
         "share": percent(counts.flat[at] / failed)}
        for at in order if counts.flat[at]
    ]  # fmt: skip
    return {
        "symbols": [symbols.html(name) for name in pair["factors"]], "gathered": pair["p_value"] < CHANCE,
        "p_value": number(pair["p_value"], 2), "information": number(max(pair["information"], 0.0), 2),
        "alone": [number(max(each, 0.0), 2) for each in pair["alone"]], "cells": cells,
    }  # fmt: skip
