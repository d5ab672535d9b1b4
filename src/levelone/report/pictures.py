"""Which pictures the report has, in its order, and what their captions say."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from matplotlib.figure import Figure

from levelone.report import symbols
from levelone.report.bode import draw_bode
from levelone.report.charts import Charts
from levelone.report.histories import draw_quickness, draw_stability, draw_sweep
from levelone.report.indices import draw_indices
from levelone.report.planes import draw_bandwidth_plane, draw_quickness_plane, draw_stability_plane
from levelone.report.results import Results
from levelone.report.screening import draw_screening


@dataclass(frozen=True)
class Picture:
    """A figure to be drawn: file name without ending, criterion it belongs to, caption, width, and how to draw it."""

    name: str
    criterion: str
    caption: str
    wide: bool
    draw: Callable[[], Figure]


def pictures(results: Results, charts: Charts) -> list[Picture]:
    """All pictures of a study."""
    histories = results.histories
    return [
        Picture("history_attitude_quickness", "attitude_quickness",
                "Step in longitudinal speed: command and response, with the points that the criterion reads.",
                False, partial(draw_quickness, histories["attitude_quickness"])),
        Picture("plane_attitude_quickness", "attitude_quickness",
                "Monte Carlo runs on the plane of the requirement. Below its range the boundaries are extended and count apart.",
                False, partial(draw_quickness_plane, results, charts.attitude_quickness)),
        *sensitivity(results, "attitude_quickness"),
        Picture("history_dynamic_stability", "dynamic_stability",
                "Pulse in longitudinal speed: the free response begins after the pulse and all delays (end of the grey band).",
                False, partial(draw_stability, histories["dynamic_stability"])),
        Picture("plane_dynamic_stability", "dynamic_stability",
                "Monte Carlo runs as poles of the mode, with the limits on damping.",
                False, partial(draw_stability_plane, results, charts.dynamic_stability)),
        *sensitivity(results, "dynamic_stability"),
        Picture("history_bandwidth", "bandwidth", "Frequency sweep of the nonlinear model.",
                True, partial(draw_sweep, histories["bandwidth"])),
        Picture("bode", "bandwidth",
                "Linearised against swept response in both readings. Circles: where bandwidth (−135 deg) and "
                "the frequency of −180 deg were read on the linear response.",
                True, partial(draw_bode, results.linear, results.swept)),
        Picture("plane_bandwidth", "bandwidth",
                "Monte Carlo runs in phase delay and bandwidth. Only the reading on attitude has a Level; the regions behind the "
                "other are there for comparison.",
                True, partial(draw_bandwidth_plane, results, charts.bandwidth)),
        *sensitivity(results, "bandwidth"),
    ]  # fmt: skip


def sensitivity(results: Results, criterion: str) -> list[Picture]:
    """Screening of each response of a criterion, and their Sobol indices together."""
    entries = results.of(criterion)
    if not entries:
        return []
    plans = [
        Picture(f"screening_{file_name(name)}", criterion,
                f"Screening of {_in_sentence(name)}: mean magnitude and standard deviation of the elementary effects over the full "
                "range of each factor, with 95 % bootstrap intervals. Above the line 1, a factor acts mainly through curvature or "
                "interaction. Factors that print on top of each other share one block of labels.",
                False, partial(draw_screening, name, entry))
        for name, entry in entries.items()
    ]  # fmt: skip
    caption = (
        "Sobol indices on the surrogate, with 95 % intervals (black: first order, grey: total). "
        "White is what a factor does together with others."
    )
    return [*plans, Picture(f"sobol_{criterion}", criterion, caption, len(entries) > 1, partial(draw_indices, entries))]


def file_name(response: str) -> str:
    """A response's name as part of a file's name."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", response)


def _in_sentence(response: str) -> str:
    title = symbols.title(response)
    return title[0].lower() + title[1:] if title != response else response
