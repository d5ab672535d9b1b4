"""The page of an assessment: what recorded data say, how far they can be trusted, and simulation against flight."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from levelone import __version__
from levelone.campaign.assessment import Assessment
from levelone.campaign.assessment_compare import Comparison
from levelone.campaign.assessment_data import Loaded
from levelone.campaign.assessment_tests import Reading
from levelone.errors import InputError
from levelone.handling.history import TimeHistory
from levelone.report import assessment_bode as bode
from levelone.report import assessment_figures as figures
from levelone.report import assessment_tables as tables
from levelone.report import style, svg
from levelone.report.page import environment

MOST_RUNS = 12
"""Steps and pulses that are drawn; all are in the tables."""
DATA, REFERENCE = "simulation", "flight"


@dataclass(frozen=True, eq=False)
class Plan:
    """A figure of the page: name, section, caption, whether it takes the full width, and how to draw it."""

    name: str
    section: str
    caption: str
    wide: bool
    draw: Callable[[], Figure]


@dataclass(frozen=True, eq=False)
class Shown:
    """What the page shows: the data, and with a reference the flight that they are compared with."""

    assessment: Assessment
    loaded: Sequence[Loaded]
    reference: Assessment | None = None
    reference_loaded: Sequence[Loaded] = field(default_factory=tuple)
    comparison: Comparison | None = None

    @property
    def sides(self) -> list[tuple[str, Assessment]]:
        """Names and assessments of what is drawn together."""
        if self.reference is None:
            return [("data", self.assessment)]
        return [(DATA, self.assessment), (REFERENCE, self.reference)]


def render_assessment(folder: str | PathLike[str], shown: Shown) -> Path:
    """Write ``assessment.html``, one file that holds its figures; return its path. The same assessment gives the same bytes.

    Raises
    ------
    InputError
        The folder cannot be written to.
    """
    page = environment().get_template("assessment.html").render(**_context(shown), drawings=_drawings(_plans(shown)))
    path = Path(folder) / "assessment.html"
    try:
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path


def _drawings(plans: Sequence[Plan]) -> list[dict[str, Any]]:
    """Figures as they stand in the page. Lines only: nothing is drawn twice."""
    found = []
    with style.paper():
        for number, plan in enumerate(plans, start=1):
            text = style.svg_of(plan.draw()).decode()
            found.append({
                "number": number, "name": plan.name, "section": plan.section, "caption": plan.caption, "wide": plan.wide,
                "svg": Markup(svg.inline(text, plan.name)),  # drawn here: text in it is outlines
            })  # fmt: skip
    return found


def _plans(shown: Shown) -> list[Plan]:
    """All figures, in the order of the page."""
    found = _swept(shown) if shown.assessment.kind == "sweep" else _planes(shown) + _runs(shown)
    return sorted(found, key=lambda plan: ("planes", "comparison", "responses", "records").index(plan.section))


def _swept(shown: Shown) -> list[Plan]:
    plans = []
    assessment = shown.assessment
    if assessment.responses:
        columns = _curves(shown)
        caption = (
            "Frequency responses of all sweeps together. Bands: 95 % of random error; pale where coherence is below the least "
            "accepted (dashed). Circles: where bandwidth (−135 deg) and −180 deg are read; phase delay at twice the latter."
        )
        plans.append(Plan("responses", "responses", caption, len(columns) > 1, partial(bode.draw_responses, columns)))
    chart = None if assessment.sweeping is None else assessment.boundaries.bandwidth.get(assessment.sweeping.task)
    points = [(name, [r for r in each.readings if r.chart.startswith("bandwidth")]) for name, each in shown.sides]
    if chart is not None and _drawable(points):
        caption = f"Bandwidth and phase delay of attitude, bars of 95 %. {tables.chart_words(chart)}"
        plans.append(Plan("plane_bandwidth", "planes", caption, False, partial(figures.draw_bandwidth_plane, points, chart)))
    responses = () if shown.comparison is None else shown.comparison.responses
    found = [(each.title, each.added) for each in responses if each.added is not None]
    if found:
        caption = (
            "Simulation over flight between the envelopes of unnoticeable added dynamics (tinted; dash-dotted: unverified, and of "
            "fighters in up-and-away flight)."
        )
        plans.append(Plan("mismatch", "comparison", caption, len(found) > 1, partial(bode.draw_mismatch, found)))
    for name, each in shown.sides:
        caption = f"Sweeps of the {name}: input and responses as recorded."
        plans.append(Plan(f"sweeps_{name}", "records", caption, True, partial(figures.draw_sweeps, each.histories, each.axis)))
    return plans


def _curves(shown: Shown) -> list[list[bode.Curve]]:
    """Columns of the figure of responses: those of attitude and of rate as measured, with the reference in the same panels."""
    columns = []
    for key in shown.assessment.responses:
        if "_from_" in key:
            continue
        curves = []
        for name, each in shown.sides:
            if key in each.responses:
                response = each.responses[key]
                reading = next((r for r in each.readings if r.title == response.title), None)
                reference = 0.0 if each.sweeping is None else each.sweeping.phase_reference
                curves.append(bode.Curve(name, response, reading, reference))
        columns.append(curves)
    return columns


def _runs(shown: Shown) -> list[Plan]:
    plans = []
    assessment = shown.assessment
    flown: Sequence[TimeHistory | None] = shown.reference.histories if shown.reference else [None] * len(assessment.histories)
    for k, (history, other) in enumerate(zip(assessment.histories, flown, strict=True)):
        if k >= MOST_RUNS:
            break
        readings = [each for each in assessment.readings if each.record == history.name]
        beside = "" if other is None else f" Dashed colour: flight ({other.name})."
        caption = f"{history.name}: changes from trim, with the points that the criteria read.{beside}"
        draw = partial(figures.draw_run, history, readings, assessment.axis, other)
        plans.append(Plan(f"run_{k + 1}", "records", caption, False, draw))
    return plans


def _planes(shown: Shown) -> list[Plan]:
    assessment, plans = shown.assessment, []
    quick, damped = (_of(shown, criterion) for criterion in ("attitude_quickness", "dynamic_stability"))
    chart = assessment.boundaries.attitude_quickness.get(assessment.axis)
    if chart is not None and _drawable(quick):
        caption = f"Attitude quickness, one point for each record. {tables.chart_words(chart)}"
        plans.append(Plan("plane_quickness", "planes", caption, False, partial(figures.draw_quickness_plane, quick, chart)))
    if _drawable(damped):
        caption = f"Poles of the free responses. {tables.chart_words(assessment.boundaries.dynamic_stability)}"
        draw = partial(figures.draw_stability_plane, damped, assessment.boundaries)
        plans.append(Plan("plane_stability", "planes", caption, False, draw))
    return plans


def _of(shown: Shown, criterion: str) -> list[tuple[str, list[Reading]]]:
    sides = [(name, [r for r in each.readings if r.criterion == criterion]) for name, each in shown.sides]
    return [(name, readings) for name, readings in sides if readings]


def _drawable(points: Sequence[tuple[str, Sequence[Reading]]]) -> bool:
    """Whether any point has both of its values."""
    return any(all(value.value == value.value for value in reading.values[:2]) for _, readings in points for reading in readings)


def _context(shown: Shown) -> dict[str, Any]:
    """Everything that the template shows, apart from the pictures."""
    assessment = shown.assessment
    return {
        "version": __version__, "kind": assessment.kind, "axis": assessment.axis, "input": assessment.input_name,
        "names": [name for name, _ in shown.sides],
        "summary": [{"side": name, "rows": tables.reading_rows(each)} for name, each in shown.sides],
        "unread": [{"title": tables.criterion_title(each.criterion), "why": each.why} for each in assessment.unread],
        "checks": [(name, each.checks) for name, each in shown.sides],
        "sweep": tables.sweep_words(assessment),
        "comparison": tables.comparison_rows(shown.comparison),
        "files": tables.file_rows(shown.loaded, assessment) + (
            tables.file_rows(shown.reference_loaded, shown.reference, REFERENCE) if shown.reference else []
        ),
        "mapping": tables.mapping_rows(shown.loaded) + tables.mapping_rows(shown.reference_loaded),
        "boundaries": assessment.boundaries,
        "drawn": min(len(assessment.histories), MOST_RUNS), "records": len(assessment.histories),
    }  # fmt: skip
