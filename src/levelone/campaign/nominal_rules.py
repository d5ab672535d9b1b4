"""Rules that tell a wrong sign, unit or record from a right one: each looks at one record and says what it saw, with numbers.

They are rules of thumb: a finding says that something looks wrong, not that it is. Limits without a source are assumed, chosen so
that the shipped studies pass and a mistake by the factor or sign that is looked for does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from levelone.campaign.models.readings import channels_of
from levelone.config.model_table import Test
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.history import FloatArray, TimeHistory

#: command -> sign with which each channel first answers a positive command: nose up, right and up are positive, and a vehicle
#: that is carried by its rotors pitches its nose down to go forward and rolls right to go right
EXPECTED: dict[str, dict[str, int]] = {
    "delta_lon": {"q": 1, "theta": 1},
    "delta_lat": {"p": 1, "phi": 1},
    "delta_ped": {"r": 1, "yaw_rate": 1, "psi": 1},
    "delta_col": {"V_vert": 1, "altitude": 1},
    "theta": {"theta": 1, "q": 1},
    "q": {"q": 1, "theta": 1},
    "phi": {"phi": 1, "p": 1},
    "p": {"p": 1, "phi": 1},
    "yaw_rate": {"yaw_rate": 1, "r": 1, "psi": 1},
    "V_lon": {"theta": -1, "V_lon": 1},
    "V_lat": {"phi": 1, "V_lat": 1},
    "V_vert": {"V_vert": 1, "altitude": 1},
}
#: a channel, that which it is the derivative of, and what a ratio other than 1 between the two may come from
DERIVATIVES = (
    *((rate, attitude, {"deg taken for rad": 180.0 / math.pi}) for rate, attitude in RATE_AND_ATTITUDE.values()),
    ("yaw_rate", "psi", {"deg taken for rad": 180.0 / math.pi}),
    ("V_vert", "altitude", {"feet taken for metres": 1.0 / 0.3048, "knots taken for m/s": 3600.0 / 1852.0, "ft/min": 196.85}),
)
LARGEST = {"theta": math.pi / 2.0, "phi": math.pi}
"""rad: angles that Euler's angles cannot exceed."""
FASTEST = 50.0
"""rad/s: angular rates beyond this are taken for deg/s (assumed)."""
ALIKE = 0.8
"""Least squared correlation at which one channel counts as the integral of another (assumed)."""
OFF = 0.25
"""Largest difference from 1 of the ratio of a channel to the derivative of its integral (assumed; small angles keep to it)."""
DRIFT = 0.02
"""Largest change before the input, as a fraction of the response (assumed; criteria refuse 0.1)."""
NOTHING = 1e-9
"""Change, as a fraction of a channel's size or in its SI unit, that counts as none."""
FIRST = 0.2
"""Fraction of the largest early change from which its sign is read."""
FLAT = 5
"""Samples at one extreme value that look like a limit, while the input moves."""


@dataclass(frozen=True)
class Finding:
    """What a rule says: its name, the test or channel, the words with their numbers, and whether it is more than a note."""

    rule: str
    where: str
    text: str
    wrong: bool = True


def record_findings(test: Test, history: TimeHistory) -> list[Finding]:
    """All findings on the record of one test, a single run."""
    return [
        *_unseen(test, history),
        *_sizes(test, history),
        *_derivatives(test, history),
        *_signs(test, history),
        *_drift(test, history),
        *_flat(test, history),
    ]


def _change(history: TimeHistory, name: str) -> FloatArray:
    return np.asarray(history.change(name)[0])


def _after(history: TimeHistory) -> np.ndarray:
    return np.asarray(history.time >= history.input_on - 1e-9)


def _seen(history: TimeHistory, name: str) -> bool:
    """Whether a channel moves after the input by more than rounding."""
    change, after = _change(history, name), _after(history)
    return bool(np.ptp(change[after]) > NOTHING * max(1.0, abs(float(history.trim[name][0]))))


def _unseen(test: Test, history: TimeHistory) -> Iterator[Finding]:
    for name in channels_of(test):
        if not _seen(history, name):
            largest = float(np.abs(_change(history, name)[_after(history)]).max())
            yield Finding(
                "no response",
                test.name,
                f"{name} does not answer {test.manoeuvre.axis}: it changes by {largest:.2g} {history.units[name]} after the input; "
                "is the input mapped to the right name, and does the model use it?",
            )


def _sizes(test: Test, history: TimeHistory) -> Iterator[Finding]:
    for name, limit in LARGEST.items():
        if name in history.channels and (largest := float(np.abs(history.channels[name][0]).max())) > limit * (1.0 + 1e-6):
            yield Finding("units", test.name, f"{name} reaches {largest:.4g} rad, beyond {limit:.3g}: is it in deg?")
    for name in ("p", "q", "r", "yaw_rate"):
        if name in history.channels and (largest := float(np.abs(history.channels[name][0]).max())) > FASTEST:
            yield Finding("units", test.name, f"{name} reaches {largest:.4g} rad/s: is it in deg/s?")


def _derivatives(test: Test, history: TimeHistory) -> Iterator[Finding]:
    """A rate against the attitude that it should integrate to: the strongest check of units and signs that a record allows."""
    for rate, integral, causes in DERIVATIVES:
        if rate not in history.channels or integral not in history.channels:
            continue
        if not (_seen(history, rate) and _seen(history, integral)):
            continue
        ratio, alike = _against_integral(history, rate, integral)
        if alike < ALIKE:
            yield Finding(
                "units",
                test.name,
                f"{rate} does not integrate to {integral} (squared correlation {alike:.2f}): are both of one axis, and in step?",
            )
        elif ratio < 0.0:
            words = f"{rate} goes against the change of {integral} (ratio {ratio:.3g}): one of their signs is wrong"
            yield Finding("sign", test.name, words)
        elif abs(ratio - 1.0) > OFF:
            likely = (f"; {value:.3g} would be {text}" for text, value in _both_ways(causes) if _near(ratio, value))
            why = next(likely, "")
            yield Finding("units", test.name, f"{rate} is {ratio:.3g} times the rate of change of {integral}{why}")


def _both_ways(causes: dict[str, float]) -> Iterator[tuple[str, float]]:
    for text, value in causes.items():
        yield f"{text}, in the first of the two", value
        yield f"{text}, in the second", 1.0 / value


def _near(ratio: float, value: float) -> bool:
    return abs(math.log(ratio / value)) < 0.25


def _against_integral(history: TimeHistory, rate: str, integral: str) -> tuple[float, float]:
    """Factor of a rate over the derivative of its integral, and their squared correlation; slow trends left out.

    Compared as integrals: a derivative by differences would fall short at a coarse sampling.
    """
    after = _after(history)
    change = _change(history, rate)[after]
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (change[1:] + change[:-1]) * history.dt)])
    other = history.channels[integral][0][after]
    other = np.unwrap(other) if integral == "psi" else other
    x, y = _detrended(other), _detrended(whole)
    power = float(x @ x) * float(y @ y)
    if power == 0.0:
        return 1.0, 1.0
    product = float(x @ y)
    return product / float(x @ x), product**2 / power


def _detrended(values: FloatArray) -> FloatArray:
    place = np.linspace(-1.0, 1.0, values.size)
    centred = values - values.mean()
    return np.asarray(centred - place * float(place @ centred) / float(place @ place))


def _signs(test: Test, history: TimeHistory) -> Iterator[Finding]:
    """The first answer to the command, before anything can swing back."""
    manoeuvre = test.manoeuvre
    for name, expected in EXPECTED[manoeuvre.axis].items():
        if name not in history.channels or not _seen(history, name):
            continue
        first = first_answer(test, history, name)
        wanted = expected * int(np.sign(manoeuvre.amplitude))
        if first * wanted < 0.0:
            way = "positive" if first > 0.0 else "negative"
            yield Finding(
                "sign",
                test.name,
                f"{name} first goes {way} ({first:.3g} {history.units[name]}) after {manoeuvre.amplitude:+g} of {manoeuvre.axis}; "
                f"{'positive' if wanted > 0 else 'negative'} is expected: look at the signs of model.inputs.{manoeuvre.axis} and "
                f"model.outputs.{name}",
            )


def first_answer(test: Test, history: TimeHistory, name: str) -> float:
    """First change of a channel that is not small beside those of the first half-cycle of the input, with its sign."""
    manoeuvre = test.manoeuvre
    change = _change(history, name)
    early = _after(history)
    if manoeuvre.shape == "sweep":
        early &= history.time <= manoeuvre.on + _first_half_cycle(test)
    inside = change[early]
    if not inside.size or not np.abs(inside).max() > 0.0:
        return 0.0
    return float(inside[np.argmax(np.abs(inside) >= FIRST * np.abs(inside).max())])


def _first_half_cycle(test: Test) -> float:
    """s from the beginning of a sweep until its input first changes sign."""
    low, high = test.manoeuvre.omega_min, test.manoeuvre.omega_max
    slope = (high - low) / (test.manoeuvre.off - test.manoeuvre.on)
    return (math.sqrt(low**2 + 2.0 * math.pi * slope) - low) / slope


def _drift(test: Test, history: TimeHistory) -> Iterator[Finding]:
    before = ~_after(history)
    for name in channels_of(test):
        if not before.any() or not _seen(history, name):
            continue
        change = _change(history, name)
        drift, answer = float(np.ptp(change[before])), float(np.abs(change[~before]).max())
        if drift > DRIFT * answer:
            yield Finding(
                "unsettled trim",
                test.name,
                f"{name} changes by {drift:.3g} {history.units[name]} before the input, {100.0 * drift / answer:.3g} % of its "
                "response: let the model settle longer, or trim it",
            )


def _flat(test: Test, history: TimeHistory) -> Iterator[Finding]:
    """A channel that stays at one extreme while a sweep goes on."""
    if test.manoeuvre.shape != "sweep":
        return
    moving = (history.time >= test.manoeuvre.on) & (history.time <= test.manoeuvre.off)
    for name in channels_of(test):
        change = _change(history, name)[moving]
        size = float(np.ptp(change))
        if not _seen(history, name):
            continue
        longest = max(_longest_run(np.abs(change - end) <= 1e-9 * size) for end in (change.min(), change.max()))
        if longest >= FLAT:
            yield Finding(
                "flat",
                test.name,
                f"{name} stays at its extreme for {longest} samples while the sweep goes on: a limit or saturation? a smaller "
                "amplitude would tell",
            )


def _longest_run(flags: np.ndarray) -> int:
    edges = np.diff(np.concatenate([[0], flags.astype(np.int64), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return int((ends - starts).max(initial=0))
