"""Descriptions of models, of what is flown with them and of where their inputs and outputs go, as a study file states them.

Plain frozen values that travel to worker processes; nothing here reads a file, imports a library or runs a model.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from levelone.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from levelone.handling.manoeuvres import Manoeuvre, Start
    from levelone.vehicle import Vehicle

Gives = Literal["histories", "responses"]
Keep = Literal["failed", "all", "none"]
Numbers = tuple[tuple[str, float], ...]
"""Names in the model and values in its own units, in the order of the file."""


@dataclass(frozen=True)
class Channel:
    """Where one command or one channel lies in the model: SI value = ``sign * scale * (value in the model)``.

    Parameters
    ----------
    levelone
        Name of the command (an axis of :class:`levelone.handling.manoeuvres.Manoeuvre`) or of the channel
        (:data:`levelone.handling.records.CHANNEL_UNITS`).
    name, unit
        In the model.
    scale
        SI and rad for one unit of the model, positive.
    sign
        -1 where the model counts the other way, else 1.
    trim
        Of an input, the model's unit: the value that the command is added to; None: the value that the model has when the input
        begins. None for an output.
    """

    levelone: str
    name: str
    unit: str
    scale: float
    sign: int
    trim: float | None = None


@dataclass(frozen=True)
class ResponseName:
    """A response that the model answers itself, and its unit in the words of the study file."""

    name: str
    unit: str


@dataclass(frozen=True)
class Test:
    """One manoeuvre, and the criterion that is read on its record.

    Parameters
    ----------
    name
        Of the test; letters, digits and underscores.
    criterion
        "attitude_quickness", "dynamic_stability", "bandwidth" or "translational_rate".
    axis
        "pitch", "roll" or "yaw"; None for "translational_rate", which is read on the velocity that is commanded.
    manoeuvre
        What is commanded. At ``method = "linear"`` nothing is flown: it names the command only.
    delay
        s: all delays between command and response that the record of the model does not state.
    output, sign
        Of a bandwidth: the channel that is read, and the sign with which it goes with the command; None and 1 otherwise.
    integrate
        Of a bandwidth on a rate: whether its response is divided by j omega, which gives that of the attitude.
    method
        "sweep" (identified on the record) or "linear" (exact frequency response of the source); "record" for other criteria.
    windows
        s: window lengths of the sweep's spectra.
    omega
        rad/s: frequencies of a linear response; None otherwise.
    coherence_min
        Least coherence at which a value is read.
    response_type
        "rate_command" or "attitude_command".
    phase_reference
        rad: as of :func:`levelone.handling.bandwidth.bandwidth`.
    task
        Bandwidth chart that sets the Level.
    """

    __test__ = False  # by its name a test collector would take it for one of its own

    name: str
    criterion: str
    axis: str | None
    manoeuvre: Manoeuvre
    delay: float = 0.0
    output: str | None = None
    sign: int = 1
    integrate: bool = False
    method: str = "record"
    windows: tuple[float, ...] = ()
    omega: tuple[float, ...] | None = None
    coherence_min: float = 0.6
    response_type: str = "rate_command"
    phase_reference: float = 0.0
    task: str = "all_other"


@dataclass(frozen=True)
class Description:
    """What every kind of model has.

    Parameters
    ----------
    kind
        As in the study file.
    fixed
        Numbers set in the model before the factors.
    inputs, outputs
        Commands and channels that are mapped; empty for a built-in vehicle, and where the model answers responses itself.
    """

    kind: str
    fixed: Numbers
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]

    def command(self, name: str) -> Channel:
        """The input that a command moves, by levelone's name; KeyError where it is not mapped."""
        return {channel.levelone: channel for channel in self.inputs}[name]


@dataclass(frozen=True, eq=False)
class BuiltInTable(Description):
    """The built-in flight simulation model: a vehicle, its trim speed (m/s), the controller's mode and the start."""

    vehicle: Vehicle
    vehicle_path: Path
    trim_speed: float
    flight_mode: str
    start: Start


@dataclass(frozen=True)
class PythonTable(Description):
    """A Python function: ``package.module:name``, the folder that is searched first, and whether it takes arrays of points."""

    function: str
    folder: Path | None
    vectorised: bool
    gives: Gives
    responses: tuple[ResponseName, ...] = ()


@dataclass(frozen=True)
class CommandTable(Description):
    """An executable.

    Parameters
    ----------
    arguments
        Argument list; ``{parameters}`` and ``{results}`` stand for the two files. No shell reads it.
    base
        Folder of the study file, which a relative path in the first argument starts from.
    format
        Of the two files: "dakota" or "json".
    folder
        Copied into the directory of each evaluation; None for an empty directory.
    time_limit
        s, infinite where there is none.
    keep
        Whose directories are kept: "failed", "all" or "none".
    gives, responses
        Whether the command answers records or responses, and which responses.
    """

    arguments: tuple[str, ...]
    base: Path
    format: Literal["dakota", "json"]
    folder: Path | None
    time_limit: float
    keep: Keep
    gives: Gives
    responses: tuple[ResponseName, ...] = ()


@dataclass(frozen=True)
class FmuTable(Description):
    """A functional mock-up unit.

    ``step`` is the communication step in s, None for that of the manoeuvre; ``settle`` are s at the inputs of trim before the
    record begins; ``tolerance`` is the relative tolerance of a model exchange, None for 1e-8.
    """

    file: Path
    mode: Literal["co-simulation", "model-exchange"]
    step: float | None
    settle: float
    tolerance: float | None


@dataclass(frozen=True)
class JsbsimTable(Description):
    """An aircraft of JSBSim.

    Parameters
    ----------
    aircraft
        Its name.
    folder
        That holds the folder of the aircraft; None for those that come with the package.
    step
        s, integration step.
    initial, set
        Properties set before the initial conditions are run, and after.
    engines_running
        Whether the engines run from the start.
    settle
        s at the inputs of trim before the record begins.
    random_seed
        Of JSBSim's own random numbers.
    """

    aircraft: str
    folder: Path | None
    step: float
    initial: Numbers
    set: Numbers
    engines_running: bool
    settle: float
    random_seed: int


@dataclass(frozen=True)
class StateSpaceTable(Description):
    """A linear model in a file of matrices."""

    file: Path


def whole_steps(dt: float, step: float, field: str) -> int:
    """Steps of a model in a sampling interval, both s; InputError at ``field`` where they are no whole number."""
    steps = round(dt / step)
    if steps < 1 or abs(steps * step - dt) > 1e-6 * dt:
        raise InputError(field, f"a sampling interval of {dt:g} s is no whole number of steps of the model, {step:g} s each")
    return steps


def quantities(test: Test) -> dict[str, str]:
    """Quantities that a test gives, and their units, SI and rad.

    The coherence is the least between ``omega_min`` and 2 omega_180, which only a sweep has.
    """
    if test.criterion == "attitude_quickness":
        from levelone.handling.axes import RATE_AND_ATTITUDE  # not every process that reads a description needs the criteria

        angle = f"delta_{RATE_AND_ATTITUDE[test.axis or 'pitch'][1]}"
        return {"quickness": "1/s", f"{angle}_min": "rad", f"{angle}_pk": "rad"}
    if test.criterion == "dynamic_stability":
        return {"zeta": "1", "omega_n": "rad/s"}
    if test.criterion == "translational_rate":
        return {"rise_time": "s", "overshoot": "1"}
    frequencies = dict.fromkeys(("omega_bw", "omega_bw_phase", "omega_bw_gain", "omega_180"), "rad/s")
    return {**frequencies, "tau_p": "s", **({"coherence": "1"} if test.method == "sweep" else {})}


def response_names(tests: Sequence[Test]) -> tuple[tuple[str, str, str], ...]:
    """(response, unit, name of the test) of everything that tests give, in their order.

    A response has the name of its quantity where one test alone gives it, else ``QUANTITY_TEST``.
    """
    given = [(quantity, unit, test.name) for test in tests for quantity, unit in quantities(test).items()]
    often = Counter(quantity for quantity, _, _ in given)
    return tuple((quantity if often[quantity] == 1 else f"{quantity}_{test}", unit, test) for quantity, unit, test in given)


ModelDescription = BuiltInTable | PythonTable | CommandTable | FmuTable | JsbsimTable | StateSpaceTable
