"""The command ``levelone assess``: criteria on recorded data of flight and simulation."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from levelone.console import announce_compilation, numbers, say, show
from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.campaign.assessment import Assessment, Request
    from levelone.campaign.assessment_data import Loaded
    from levelone.config.column_mapping import Source

AxisName = Literal["pitch", "roll", "yaw", "heave"]
Kind = Literal["sweep", "step", "pulse"]
ResponseType = Literal["rate_command", "attitude_command"]
Agility = Literal["limited", "moderate", "aggressive"]
Task = Literal["all_other", "target_acquisition", "divided_attention"]

Data = Annotated[list[Path], typer.Argument(metavar="DATA...", help="Records of one manoeuvre: .csv, .parquet, .mat, .ulg")]
ColumnsOption = Annotated[str | None, typer.Option(metavar="MAP", help="Channels, like 'theta=pitch[deg], q=gyro_y*-1'.")]
MappingOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Channels in a TOML file, in place of --columns.")]
AxisOption = Annotated[AxisName | None, typer.Option(help="Axis of the input.  [default: that of its channel]")]
KindOption = Annotated[Kind | None, typer.Option(help="What the input is.  [default: found in the data]")]
InputOption = Annotated[str | None, typer.Option("--input", metavar="CHANNEL", help="Channel of the input.")]
FromOption = Annotated[float | None, typer.Option("--from", help="First second of the data that is used, of each file's clock.")]
ToOption = Annotated[float | None, typer.Option("--to", help="Last second that is used.")]
OnOption = Annotated[float | None, typer.Option("--on", help="Beginning of the input, s.  [default: found in the data]")]
OffOption = Annotated[float | None, typer.Option("--off", help="End of a pulse, s.  [default: found in the data]")]
DelayOption = Annotated[
    float | None, typer.Option(min=0.0, help="Delay from command to response, s.  [default: until the rate moves]")
]
GapOption = Annotated[float, typer.Option(min=1.0, help="Intervals without a sample that may be bridged by a straight line.")]
OmegaOption = Annotated[str | None, typer.Option(metavar="LOW,HIGH", help="Range of a sweep, rad/s.  [default: what it excites]")]
WindowsOption = Annotated[
    str | None, typer.Option(metavar="S,S,...", help="Windows of a sweep, s.  [default: parts of the record]")
]
TypeOption = Annotated[ResponseType, typer.Option(help="Rate command counts the smaller bandwidth of phase and gain.")]
BranchOption = Annotated[float, typer.Option(help="Phase near which a response begins at low frequency, deg.")]
TaskOption = Annotated[Task, typer.Option(help="Chart of the bandwidth.")]
AgilityOption = Annotated[Agility | None, typer.Option(help="Of the tasks that large amplitudes are judged for.")]
BoundariesOption = Annotated[str | None, typer.Option(metavar="FILE", help="Level boundaries.  [default: those of the axis]")]
TolerancesOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Tolerances.  [default: 14 CFR 60 Appendix C]")]
ReferenceOption = Annotated[
    list[Path] | None, typer.Option(metavar="FILE", help="Flight that DATA, a simulation, are held against.")
]
ReferenceColumns = Annotated[str | None, typer.Option(metavar="MAP", help="As --columns.  [default: the same]")]
ReferenceMapping = Annotated[Path | None, typer.Option(metavar="FILE", help="As --mapping.  [default: the same]")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the page.  [default: results/assessment-RECORD]")]


def assess(
    data: Data, columns: ColumnsOption = None, mapping: MappingOption = None, axis: AxisOption = None, kind: KindOption = None,
    input_name: InputOption = None, start: FromOption = None, end: ToOption = None, on: OnOption = None, off: OffOption = None,
    delay: DelayOption = None, gap: GapOption = 5.0, omega: OmegaOption = None, windows: WindowsOption = None,
    response_type: TypeOption = "rate_command", phase_reference: BranchOption = 0.0, task: TaskOption = "all_other",
    agility: AgilityOption = None, boundaries: BoundariesOption = None,
    reference: ReferenceOption = None, reference_columns: ReferenceColumns = None,
    reference_mapping: ReferenceMapping = None, tolerances: TolerancesOption = None, out: Out = None,
) -> None:  # fmt: skip
    """Handling qualities of recorded data, as one page: sweeps taken together, steps and pulses one by one."""
    from levelone.campaign.assessment import Request
    from levelone.campaign.assessment import assess as read
    from levelone.campaign.assessment_data import load_records

    sources = _sources(columns, mapping, "--columns", "--mapping")
    for option, value in (("columns", reference_columns), ("mapping", reference_mapping)):
        if reference is None and value is not None:
            raise InputError(f"--reference-{option}", "belongs to --reference")
    if reference is None and tolerances is not None:
        raise InputError("--tolerances", "belongs to --reference")
    low, high = _pair(omega)
    request = Request(
        axis=axis, kind=kind, input_name=input_name, input_on=on, input_off=off, delay=delay, omega_min=low, omega_max=high,
        windows=None if windows is None else tuple(numbers(windows, "--windows")), response_type=response_type,
        phase_reference=math.radians(phase_reference), task=task, agility=agility, boundaries=boundaries,
    )  # fmt: skip
    window: dict[str, Any] = {
        "start": -math.inf if start is None else start, "end": math.inf if end is None else end, "largest_gap": gap
    }  # fmt: skip
    folder = _folder(out, data)
    # what draws is loaded beside what reads and computes, which takes as long
    Thread(target=import_module, args=("matplotlib.backends.backend_svg",), daemon=True).start()
    loaded = load_records(data, sources, **window)
    announce_compilation()
    found = read([each.record for each in loaded], request)
    flown = None
    if reference is not None:
        others = _sources(reference_columns, reference_mapping, "--reference-columns", "--reference-mapping")
        # what is counted on the data's clock says nothing about that of the reference
        theirs = replace(request, input_on=None, input_off=None, delay=None)
        flown = _reference(reference, others if others is not None else sources, {"largest_gap": gap}, theirs)
    _say(found, loaded)
    _write(folder, found, loaded, flown, tolerances)


def _sources(columns: str | None, mapping: Path | None, first: str, second: str) -> dict[str, Source] | None:
    from levelone.config.column_mapping import parse_columns, read_mapping

    if columns is not None and mapping is not None:
        raise InputError(first, f"and {second} both map the columns: give one of them")
    if columns is not None:
        return parse_columns(columns, first)
    return None if mapping is None else read_mapping(mapping)


def _pair(omega: str | None) -> tuple[float | None, float | None]:
    if omega is None:
        return None, None
    ends = numbers(omega, "--omega")
    if len(ends) != 2 or not 0.0 < ends[0] < ends[1]:
        raise InputError("--omega", f"{omega!r} is no range: write LOW,HIGH like 0.4,16")
    return ends[0], ends[1]


def _reference(
    paths: list[Path], sources: dict[str, Source] | None, window: dict[str, Any], request: Request
) -> tuple[Assessment, list[Loaded]]:
    from levelone.campaign.assessment import assess as read
    from levelone.campaign.assessment_data import load_records

    loaded = load_records(paths, sources, **window)
    return read([each.record for each in loaded], request), loaded


def _folder(out: Path | None, data: list[Path]) -> Path:
    """The folder of the results, made; InputError before anything is computed if it cannot be."""
    folder = out if out is not None else Path("results") / f"assessment-{data[0].stem}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", f"{folder} cannot be made: {error.strerror}") from None
    return folder


def _say(found: Assessment, loaded: list[Loaded]) -> None:
    """What was recognised and read, for the eye."""
    from levelone.campaign.assessment_record import level_text

    for each, shape in zip(loaded, found.inputs, strict=True):
        end = "" if math.isnan(shape.off) else f" to {shape.off:.3f} s"
        say(f"{each.record.name}: {shape.kind} of {found.input_name} ({found.axis}) from {shape.on:.3f} s{end}")
        for note in each.table.notes:
            say(f"{each.record.name}: {note}")
        if each.assumed_units:
            say(f"{each.record.name}: no unit stated, taken as SI and rad: {', '.join(each.assumed_units)}")
    rows = [(reading, value) for reading in found.readings for value in reading.values]
    show("Readings (SI, rad)", {
        "criterion": [reading.criterion for reading, _ in rows], "read from": [reading.title for reading, _ in rows],
        "record": [reading.record for reading, _ in rows], "value": [value.name for _, value in rows],
        "": [value.value for _, value in rows], "std": [value.error for _, value in rows],
        "unit": [value.unit for _, value in rows], "level": [level_text(reading) for reading, _ in rows],
        "status": [value.text for _, value in rows],
    })  # fmt: skip
    for unread in found.unread:
        say(f"not read: {unread.criterion}: {unread.why}")
    for check in found.checks:
        say(f"look again: {check}")


def _write(
    folder: Path,
    found: Assessment,
    loaded: list[Loaded],
    flown: tuple[Assessment, list[Loaded]] | None,
    tolerances: Path | None,
) -> None:
    from levelone.campaign.assessment_record import record_of, write_record
    from levelone.report.assessment import Shown, render_assessment

    comparison = None
    if flown is not None:
        from levelone.campaign.assessment_compare import compare
        from levelone.handling.tolerances import load_tolerances

        comparison = compare(found, flown[0], load_tolerances(tolerances))
        for check in flown[0].checks:
            say(f"look again at the reference: {check}")
        if comparison.responses:
            say(f"mismatch cost J = {comparison.cost:.3g}: {comparison.verdict} (recalled limits, unverified)")
    try:
        record = write_record(folder, record_of(found, loaded, flown, comparison))
    except OSError as error:
        raise InputError("--out", f"{folder} cannot be written: {error.strerror}") from None
    shown = Shown(found, loaded, *(flown or (None, ())), comparison)
    page = render_assessment(folder, shown)
    say(f"results: {record}")
    say(f"page:    {page}")
