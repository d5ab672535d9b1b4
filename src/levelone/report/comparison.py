"""The findings of the reference study held against this one: verdicts with their causes, and how experiments move them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from levelone.campaign.claims.causes import outdated
from levelone.campaign.claims.evidence import stored_evidence
from levelone.campaign.claims.record import Record, Trial
from levelone.campaign.compare import Verdict, counts, left_out, recorded, verdicts_of
from levelone.report import style
from levelone.report.formatting import number
from levelone.report.pictures import Picture
from levelone.report.results import Results

#: colour of each verdict, in figures and tables; the words and marks stand beside it
COLOURS = {"agrees": "#007a59", "differs": "#b84e00", "undecidable": style.GREY}
_MARKS: dict[str, dict[str, Any]] = {
    "agrees": {"marker": "o", "markersize": 4.6, "markeredgewidth": 0.0, "color": COLOURS["agrees"]},
    "differs": {"marker": "x", "markersize": 4.6, "markeredgewidth": 1.3, "color": COLOURS["differs"]},
    "undecidable": {"marker": "_", "markersize": 5.0, "markeredgewidth": 1.0, "color": style.FAINT},
}
_TURNED: dict[str, Any] = {"facecolor": "#fbe3a1", "edgecolor": "none"}
_ROW = 0.155
"""in: height of a row of the matrix."""
_LETTER = 0.047
"""in: width of a letter of its labels, 7 pt, on the safe side."""
_HERE = "this study"


def context(results: Results) -> dict[str, Any] | None:
    """Tables of verdicts and experiments; None where the study names no findings."""
    if not results.summary.get("findings"):
        return None
    found = _verdicts(results)
    record = recorded(results.directory)
    why_not = outdated(record, results.summary)
    trials = [] if record is None or why_not else record.experiments
    return {
        "counts": counts(found),
        "calibrated": sum(each.calibrated for each in found),
        "left_out": left_out(found),
        "rows": [_row(each) for each in found],
        "experiments": [_trial(each) for each in trials],
        "recorded": why_not,
    }


def pictures(results: Results) -> list[Picture]:
    """The matrix of verdicts; none where no experiments are recorded for this study."""
    if not results.summary.get("findings"):
        return []
    record = recorded(results.directory)
    if record is None or outdated(record, results.summary) or not record.experiments:
        return []
    caption = (
        "Verdict of every claim on this study, in every experiment, and in every other calibration. Yellow: another verdict than "
        "on this study. Claims in brackets are what a calibration may aim at, and do not count."
    )
    return [Picture("comparison", "comparison", caption, True, partial(draw_matrix, _verdicts(results), record))]


def _verdicts(results: Results) -> list[Verdict]:
    return verdicts_of(stored_evidence(results.summary, results.monte_carlo), results.directory)


def _row(verdict: Verdict) -> dict[str, Any]:
    return {
        "id": verdict.id, "rule": verdict.rule, "here": verdict.here, "verdict": verdict.verdict, "cause": verdict.cause,
        "robust": verdict.robust, "calibrated": verdict.calibrated, "colour": COLOURS[verdict.verdict],
    }  # fmt: skip


def _trial(trial: Trial) -> dict[str, Any]:
    changes = [f"{path} = {value if isinstance(value, str) else number(value)}" for path, value in trial.changes.items()]
    found = [each.verdict for each in trial.verdicts.values()]
    return {
        "name": trial.name, "kind": trial.kind, "question": trial.question, "changes": changes,
        "agrees": found.count("agrees"), "differs": found.count("differs"), "undecidable": found.count("undecidable"),
    }  # fmt: skip


def draw_matrix(verdicts: Sequence[Verdict], record: Record) -> Figure:
    """One row a claim, one column a vehicle: this study, the experiments, the calibrations."""
    here = {each.id: str(each.verdict) for each in verdicts}
    groups: list[dict[str, Mapping[str, str]]] = [{_HERE: here}]
    groups += [_columns(record.of_kind("cause")), _columns(record.of_kind("calibration"))]
    names = [name for group in groups for name in group]
    rows = [f"({each.id})" if each.calibrated else each.id for each in verdicts]
    margins = style.Margins(
        left=_LETTER * max(map(len, rows)) + 0.12, right=0.06, bottom=0.3, top=_LETTER * max(map(len, names)) + 0.12
    )
    figure, axes = style.sheet(style.PAGE, _ROW * len(rows) + margins.bottom + margins.top, margins=margins)
    panel: Axes = axes[0, 0]
    _frame(panel, rows, names, 72.0 * (style.PAGE - margins.left - margins.right) / len(names))
    place = 0
    for group in groups:
        for column in group.values():
            _marks(panel, place, [column.get(name, "") for name in here], list(here.values()))
            place += 1
        panel.axvline(place - 0.5, color=style.BLACK, linewidth=0.6)
    handles: list[Any] = [Line2D([], [], linestyle="none", label=verdict, **look) for verdict, look in _MARKS.items()]
    handles.append(Patch(**_TURNED, label="another verdict than on this study"))
    figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 0.0), ncols=len(handles))
    return figure


def _columns(trials: Sequence[Trial]) -> dict[str, Mapping[str, str]]:
    return {trial.name: {name: found.verdict for name, found in trial.verdicts.items()} for trial in trials}


def _frame(panel: Axes, rows: Sequence[str], names: Sequence[str], cell: float) -> None:
    """Bands that lead the eye along the rows, and labels that shrink with the columns (``cell``: their width, pt)."""
    for i in range(0, len(rows), 2):
        panel.axhspan(i - 0.5, i + 0.5, color="#f1f3f5", linewidth=0.0, zorder=0)
    panel.set(xlim=(-0.5, len(names) - 0.5), ylim=(len(rows) - 0.5, -0.5))
    panel.set_yticks(range(len(rows)), rows, fontsize=7)
    panel.set_xticks(range(len(names)), names, rotation=90, fontsize=min(7.0, 0.9 * cell))
    panel.xaxis.tick_top()
    panel.tick_params(axis="both", length=0.0, pad=2.0)


def _marks(panel: Axes, place: int, column: Sequence[str], here: Sequence[str]) -> None:
    """One column, shaded where its verdict is another one than ``here``; empty where a claim was not asked."""
    for i, (found, own) in enumerate(zip(column, here, strict=True)):
        if found not in ("", own):
            panel.add_patch(Rectangle((place - 0.5, i - 0.5), 1.0, 1.0, **_TURNED, zorder=1))
    for verdict, look in _MARKS.items():
        at = [i for i, found in enumerate(column) if found == verdict]
        panel.plot([place] * len(at), at, linestyle="none", zorder=3, **look)
