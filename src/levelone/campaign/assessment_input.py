"""What the input of a recorded run is: a sweep, a step or a pulse; on which axis, when it begins and ends, what it excites."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from levelone.errors import InputError, closest
from levelone.handling.history import TimeHistory

FloatArray = NDArray[np.float64]
Kind = Literal["sweep", "step", "pulse"]
AxisName = Literal["pitch", "roll", "yaw", "heave"]

AXIS_OF: dict[str, AxisName] = {
    **dict.fromkeys(("delta_lon", "V_lon_ref", "theta_ref", "q_ref"), "pitch"),
    **dict.fromkeys(("delta_lat", "V_lat_ref", "phi_ref", "p_ref"), "roll"),
    **dict.fromkeys(("delta_ped", "yaw_rate_ref", "r_ref", "psi_ref"), "yaw"),
    **dict.fromkeys(("delta_col", "V_vert_ref", "altitude_ref"), "heave"),
}
"""Axis that an input is made for."""

THRESHOLD = 0.1
"""Departure from its value before the input, as a fraction of the largest one, at which an input counts as begun."""
STILL, BACK = 0.005, 0.02
"""The same fraction within which it has not moved at all yet, and within which it is back: what is left drives the response."""
HELD = 0.9
"""The same fraction that an input has as long as it has not begun to come back."""
NOISE, LONE = 4.0, 5.0
"""Times its own standard deviation before the input that a departure must exceed at the least, and that the last one must."""
UNSTEADY = 0.02
"""Standard deviation before a step or pulse, as a fraction of its size, above which there is no trim."""
REVERSALS = 4
"""Changes of side from which on an input is a sweep; a step and a pulse have none."""
STAYS, RETURNS = 0.5, 0.2
"""Fraction of its largest departure that a step still has at the end of the record, and that a pulse is down to."""
EXCITED_DB = 30.0
"""How far the input's spectrum may lie below its peak where a sweep still counts as exciting the aircraft."""
PERIODS = 2.0
"""Periods of the lowest frequency in the longest window, which is 0.6 of the record."""

_BINS = 6
"""Bins an octave of the smoothed spectrum."""


@dataclass(frozen=True)
class Input:
    """An input as it was recognised.

    Parameters
    ----------
    kind
        ``"sweep"``, ``"step"`` or ``"pulse"``.
    moves, on, off
        s: first sample that moves at all, first one off the value before by :data:`THRESHOLD`, and first one back for good,
        within :data:`BACK`; ``off`` is NaN for a step.
    before
        Value before the input; the mean of the whole record where nothing came before it.
    size
        Largest departure from it, with its sign.
    returns_in
        s from the last sample at :data:`HELD` of it to ``off``; NaN for a step.
    turns
        How often it changes sides; never for a step or pulse.
    """

    kind: Kind
    moves: float
    on: float
    off: float
    before: float
    size: float
    returns_in: float
    turns: int


def recognise(time: FloatArray, values: FloatArray, *, kind: Kind | None = None, name: str = "input") -> Input:
    """Kind and times of an input from its own record.

    Parameters
    ----------
    time, values
        ``[sample]``: s, and the input in any unit.
    kind
        What it is, where the user says so.
    name
        Of the channel, for errors.

    Raises
    ------
    InputError
        An input that does not move, that moves from the first sample on (step, pulse), or that is neither of the three; one that
        changes sides without being a sweep (a doublet), unless the user says what it is.
    """
    first = _begins(values)
    if first is None:
        raise InputError(
            name,
            f"does not move beyond its noise at the start of the record (range {np.ptp(values):.3g}): see --input and --from",
        )
    still = _still(values, first)
    before = float(values[:still].mean()) if first >= 2 else float(values.mean())
    change = values - before
    size = float(change[np.argmax(np.abs(change))])
    turns = int(np.count_nonzero(np.diff(np.sign(change[np.abs(change) > THRESHOLD * abs(size)]))))
    found = kind or _kind(change, size, turns, name)
    if found != "sweep" and first < 2:
        raise InputError(
            name, f"moves from the first sample at {time[0]:.4g} s on: no trim before it; begin the record earlier, or set --from"
        )
    noise = float(values[:still].std())
    if found != "sweep" and noise > UNSTEADY * abs(size):
        raise InputError(name, f"is not steady before {time[first]:.4g} s: begin the record with trim, or set --from")
    last = _last(change, size, noise) if found != "step" else None
    if found == "pulse" and last is None:
        raise InputError(name, f"has not come back at the end of the record, {time[-1]:.4g} s: this is no pulse")
    off = math.nan if last is None else float(time[last + 1])
    held = float(time[np.flatnonzero(np.abs(change) >= HELD * abs(size))[-1]])
    return Input(found, float(time[still]), float(time[first]), off, before, size, off - held, turns)


def _still(values: FloatArray, first: int) -> int:
    """Number of samples before the input moves at all: a control that is moved slowly is on its way before it counts as begun."""
    if first < 2:
        return first
    quiet = values[: max(first // 2, 2)]
    size = float(np.abs(values - np.median(quiet)).max())
    moved = np.abs(values[:first] - np.median(quiet)) > max(STILL * size, NOISE * float(quiet.std()))
    still = np.flatnonzero(~moved)
    return max(int(still[-1]) + 1, 2) if still.size else first


def _last(change: FloatArray, size: float, noise: float) -> int | None:
    """Last sample before the input is back for good; None where it does not come back.

    A control comes to rest near its value before, hardly ever on it: it counts as back where it keeps to where it ends.
    """
    end = float(change[-max(change.size // 10, 5) :].mean())
    if abs(end) > THRESHOLD * abs(size):
        return None
    away = np.flatnonzero(np.abs(change - end) > max(BACK * abs(size), LONE * noise))
    return int(away[-1]) if away.size and away[-1] + 1 < change.size else None


def _begins(values: FloatArray) -> int | None:
    """First sample of the input: off the value before by a tenth of the largest departure, and by more than the noise."""
    head = values[: max(values.size // 50, 5)]
    first = None
    for _ in range(3):  # the value before is known better once the beginning is
        change = np.abs(values - np.median(head))
        limit = max(THRESHOLD * float(change.max()), NOISE * float(head.std()) if head.size > 2 else 0.0)
        beyond = np.flatnonzero(change > limit)
        if not beyond.size or float(change.max()) == 0.0:
            return first
        first = int(beyond[0])
        if first < 5:
            return first
        head = values[:first]
    return first


def _kind(change: FloatArray, size: float, turns: int, name: str) -> Kind:
    if turns >= REVERSALS:
        return "sweep"
    if turns:
        raise InputError(
            name,
            f"changes sides {turns} times: neither step, pulse nor sweep (a doublet or a 3-2-1-1 is none of them); "
            "--kind says what it shall be read as",
        )
    end = abs(float(change[-max(change.size // 10, 5) :].mean()) / size)
    if end >= STAYS:
        return "step"
    if end <= RETURNS:
        return "pulse"
    raise InputError(
        name, f"ends at {end:.2g} of its largest departure: neither a step nor a pulse nor a sweep; say which with --kind"
    )


def until_moved(time: FloatArray, rate: FloatArray, on: float) -> float:
    """Time from the input to where the rate has moved by :data:`THRESHOLD` of its largest change, s.

    No response begins before every delay has passed: after a sharp input this is an upper bound of the delay. It is none for a
    control that moves slowly, which is on its way before ``on``.

    Parameters
    ----------
    time, rate
        ``[sample]``: s, and the rate's change from trim.
    on
        s: beginning of the input.
    """
    after = time >= on - 1e-9
    moved = np.abs(rate[after])
    if not moved.size or not moved.max() > 0.0:
        return 0.0
    return max(float(time[after][np.argmax(moved >= THRESHOLD * moved.max())]) - on, 0.0)


def choose_input(channels: Sequence[str], given: str | None, axis: str | None) -> str:
    """The channel that holds the input: the one given, or the only one among the channels that is an input on the axis.

    Raises
    ------
    InputError
        An unknown channel, no input or several.
    """
    if given is not None:
        if given not in channels:
            raise InputError("--input", f"the data have no channel {given!r}; {closest(given, channels)}")
        return given
    found = [name for name in channels if name in AXIS_OF and axis in (None, AXIS_OF[name])]
    if len(found) == 1:
        return found[0]
    if not found:
        where = f" on the axis of {axis}" if axis else ""
        raise InputError("--input", f"no channel is an input{where}; map one of {', '.join(AXIS_OF)}, or name it")
    raise InputError("--input", f"{', '.join(found)} are all inputs: say which one moved")


def choose_axis(input_name: str, given: AxisName | None) -> AxisName:
    """The axis given, or that of the input; InputError where neither says."""
    if given is not None:
        return given
    if input_name not in AXIS_OF:
        raise InputError("--axis", f"is not known from the input {input_name!r}: give pitch, roll, yaw or heave")
    return AXIS_OF[input_name]


def excited_range(histories: Sequence[TimeHistory]) -> tuple[float, float]:
    """Frequencies, rad/s, that the inputs of several sweeps excite together.

    The range around the peak of the input's spectrum (averaged over sixths of an octave, all records added) in which it lies no
    further below the peak than :data:`EXCITED_DB`; from :data:`PERIODS` periods in the longest window on.

    Raises
    ------
    InputError
        No frequency is excited above what the record is long enough for.
    """
    duration = min(float(history.time[-1] - history.time[0]) for history in histories)
    low = PERIODS * 2.0 * math.pi / (0.6 * duration)
    high = math.pi / histories[0].dt
    edges = np.geomspace(low, high, max(math.ceil(_BINS * math.log2(high / low)), 2) + 1)
    power = np.zeros(edges.size - 1)
    for history in histories:
        for change in history.change(history.input_name):
            energy = np.abs(np.fft.rfft(change)) ** 2  # no taper: it would hide the ends of the sweep, and both ends are trim
            omega = 2.0 * np.pi * np.fft.rfftfreq(change.size, history.dt)
            sums, counts = (np.histogram(omega, edges, weights=w)[0] for w in (energy, None))
            power += np.where(counts > 0, sums / np.maximum(counts, 1), 0.0)
    peak = int(np.argmax(power))
    strong = power >= power[peak] * 10.0 ** (-EXCITED_DB / 10.0)
    if not power[peak] > 0.0:
        raise InputError("sweep", "its input excites no frequency: it does not move")
    first = peak - int(np.argmin(np.append(strong[peak::-1], False))) + 1
    last = peak + int(np.argmin(np.append(strong[peak:], False))) - 1
    return float(edges[first]), float(edges[last + 1])
