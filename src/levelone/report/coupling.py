"""Pitch-roll coupling: which factors the pitch responses notice, and how far a pitch command rolls the aircraft."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from levelone.campaign.coupling import DROPPED, PITCH, relative
from levelone.handling.coupling import ROUNDING
from levelone.report import style, symbols
from levelone.report.formatting import interval, number, percent, percent_interval
from levelone.report.pictures import Picture
from levelone.report.results import Results

FloatArray = NDArray[np.float64]

_STUDY: dict[str, Any] = {"color": style.BLUE, "linewidth": 0.0}
_ADDED: dict[str, Any] = {"color": style.ORANGE, "linewidth": 0.0}
_LEAST = 1e-4
"""Left end of the axis: below it a part of the largest effect cannot be told from nothing in print."""


def context(results: Results) -> dict[str, Any] | None:
    """Tables of the screening and of the ratio; None where the study has no such section."""
    given = results.summary.get("coupling")
    if not given:
        return None
    parts, names = _parts(given), list(given["mu_star"][PITCH[0]])
    order = np.argsort(-np.nan_to_num(parts.max(axis=0), nan=np.inf), kind="stable").tolist()
    return {
        "note": given.get("note", ""),
        "n": given["n"],
        "trajectories": given["trajectories"],
        "limit": percent(DROPPED),
        "dropped": [symbols.html(name) for name in given["dropped"]],
        "undecided": [symbols.html(name) for name in given["undecided"]],
        "responses": [(symbols.title(name), symbols.html(name)) for name in PITCH],
        "rows": [
            {"symbol": symbols.html(names[j]), "added": names[j] in given["added"], "dropped": names[j] in given["dropped"],
             "parts": [percent(part) if part else "0" for part in parts[:, j].tolist()],
             "ratio": number(given["mu_star"]["ratio"][names[j]], 3)}
            for j in order
        ],
        "ratios": [
            _ratio("to the largest pitch attitude change: sets the Level", given["ratio"], given["ratio_status"]),
            _ratio("to the change at 4 s, as the standard words it", given["ratio_literal"], given["ratio_literal_status"]),
        ],
        "shares": _shares(given["level_shares"]),
    }  # fmt: skip


def pictures(results: Results) -> list[Picture]:
    """One bar for each factor."""
    given = results.summary.get("coupling")
    if not given:
        return []
    caption = (
        "Largest part that a factor's mean elementary effect is of the largest one, over the six responses of the pitch axis: "
        "left of the line, a factor has dropped out."
    )
    return [Picture("coupling", "coupling", caption, False, partial(draw_coupling, given))]


def draw_coupling(given: Mapping[str, Any]) -> Figure:
    """Bars over a logarithmic axis, most influential on top; what lies left of the axis is written beside it."""
    names = np.array(list(given["mu_star"][PITCH[0]]))
    largest = _parts(given).max(axis=0)
    order = np.argsort(-np.nan_to_num(largest, nan=np.inf), kind="stable")
    names, largest = names[order], largest[order]
    figure, axes = style.sheet(style.COLUMN, 0.7 + 0.142 * len(names), margins=style.Margins(left=0.45, right=0.2, top=0.3))
    panel, place = axes[0, 0], np.arange(len(names))
    for chosen, look in ((np.isin(names, given["added"]), _ADDED), (~np.isin(names, given["added"]), _STUDY)):
        seen = chosen & (largest > _LEAST)
        panel.barh(place[seen], largest[seen] - _LEAST, left=_LEAST, height=0.72, **look)
    panel.set_xscale("log")
    panel.set(xlim=(_LEAST, 1.2), ylim=(len(names) - 0.4, -0.6))
    for i in np.flatnonzero(~(largest > _LEAST)):
        text = "undefined" if math.isnan(largest[i]) else "none" if largest[i] == 0.0 else f"below {100.0 * _LEAST:g} %"
        text += " (added)" if names[i] in given["added"] else ""
        panel.text(1.15 * _LEAST, i, text, va="center", fontsize=7, color=style.GREY)
    panel.axvline(DROPPED, color=style.VERMILLION, linewidth=0.8)
    panel.set_yticks(place, [symbols.mathtext(name) for name in names], fontsize=7.5)
    panel.tick_params(axis="y", length=0.0)
    panel.set_xticks([1e-4, 1e-3, 1e-2, 1e-1, 1.0], ["0.01 %", "0.1 %", "1 %", "10 %", "100 %"])
    panel.set_xlabel(r"$\mu^*$, part of the largest")
    style.grid(panel, "x")
    handles = [Patch(**_STUDY, label="factor of the study"), Patch(**_ADDED, label="added roll factor")]
    style.key(figure, handles, columns=2)
    return figure


def _parts(given: Mapping[str, Any]) -> FloatArray:
    """Each mu_star as a part of the largest of its response, ``[response, factor]``; what is rounding is 0."""
    parts = np.array([relative(list(given["mu_star"][name].values())) for name in PITCH])
    return np.where(parts < ROUNDING, 0.0, parts)


def _ratio(text: str, sample: Mapping[str, Any], status: Mapping[str, int]) -> dict[str, Any]:
    return {
        "text": text, "mean": number(sample["mean"]), "range": interval([sample["p05"], sample["p95"]]),
        "largest": number(sample["max"]), "failed": f"{sample['failed']} of {sample['n']}",
        "status": [f"{count}: {words}" for words, count in status.items()],
    }  # fmt: skip


def _shares(entry: Mapping[str, Any]) -> dict[str, Any]:
    keys = ("level_1", "level_2", "level_3", "failed")
    return {"shares": [percent(entry[key]) for key in keys], "interval": percent_interval(entry["level_1_ci"]), "n": entry["n"]}
