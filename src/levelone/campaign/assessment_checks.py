"""What looks wrong in recorded data: units, signs, trim, sampling. Each finding is a sentence; nothing is changed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.assessment_input import AXIS_OF, Input
from levelone.campaign.assessment_sweep import Response
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.bandwidth import COHERENCE_MIN
from levelone.handling.history import TimeHistory

FloatArray = NDArray[np.float64]

INTEGRALS = (*RATE_AND_ATTITUDE.values(), ("V_vert", "altitude"))
"""Channels of which the second is nearly the integral of the first."""
DISAGREES = 0.2
"""Departure from 1 of the factor between a channel and the integral of its rate that is worth a sentence."""
EXPLAINED = 0.5
"""Share of a channel's movement that the integral of its rate must explain for the factor to mean anything."""
FEW_SAMPLES = 20.0
"""Samples a period of the highest frequency that is read, below which the sampling counts as coarse."""


def checks_of(histories: Sequence[TimeHistory], inputs: Sequence[Input], axis: str, responses: Mapping[str, Response]) -> list[str]:
    """Everything that looks wrong, one sentence each."""
    found: list[str] = []
    for rate, angle in INTEGRALS:
        if all(rate in history.channels and angle in history.channels for history in histories):
            found += _agreement(histories, rate, angle)
    for history, shape in zip(histories, inputs, strict=True):
        if shape.kind != "sweep":
            found += _direction(history, axis)
            if shape.turns:
                found.append(f"{history.name}: the input changes sides {shape.turns} times: criteria on a {shape.kind} do not hold")
        elif not (history.time < history.input_on - 1e-9).any():
            found.append(f"{history.name}: the sweep begins with the record; changes are counted from its mean, not from trim")
    rate = RATE_AND_ATTITUDE.get(axis, ("V_vert",))[0]
    for key, response in responses.items():
        if rate not in responses or key == rate:  # an angle that disagrees with its rate is seen above
            found += _signs(response, key, axis, histories[0])
        found += _sampling(response, histories[0])
    return found


def _agreement(histories: Sequence[TimeHistory], rate: str, angle: str) -> list[str]:
    """The factor between an angle and the integral of its rate, over all records; a drift of the rate's zero is allowed for."""
    products = np.zeros(3)
    for history in histories:
        time = history.time - history.time.mean()
        turned = np.unwrap(history.channels[angle][0]) if angle in ("phi", "psi") else history.channels[angle][0]
        steps = 0.5 * (history.channels[rate][0][1:] + history.channels[rate][0][:-1]) * history.dt
        pair = np.stack([np.concatenate([[0.0], np.cumsum(steps)]), turned])
        line = np.polynomial.polynomial.polyfit(time, pair.T, 1)
        x, y = pair - np.polynomial.polynomial.polyval(time, line)
        products += x @ x, x @ y, y @ y
    xx, xy, yy = products
    if not (xx > 0.0 and yy > 0.0):
        return []
    factor, share = xy / xx, xy**2 / (xx * yy)
    if share < EXPLAINED:
        return [f"{angle} does not follow the integral of {rate} (it explains {100.0 * share:.0f} % of it): are they of one axis?"]
    if abs(factor - 1.0) <= DISAGREES:
        return []
    return [f"{angle} moves {factor:.3g} times as far as the integral of {rate} says: is a unit or a sign wrong?"]


def _follows(history: TimeHistory, axis: str) -> bool:
    """Whether the input is one that its axis follows: forward speed pitches the nose down, and an input of another axis couples."""
    return AXIS_OF.get(history.input_name) == axis and history.input_name != "V_lon_ref"


def _direction(history: TimeHistory, axis: str) -> list[str]:
    """After a step or pulse the rate goes first to the side of the input: read where it has half of its largest change."""
    rate = RATE_AND_ATTITUDE.get(axis, ("V_vert",))[0]
    if rate not in history.channels or not _follows(history, axis):
        return []
    after = history.time >= history.input_on - 1e-9
    moved, given = (history.change(name)[0][after] for name in (rate, history.input_name))
    first = moved[np.argmax(np.abs(moved) >= 0.5 * np.abs(moved).max())]
    if first * given[np.argmax(np.abs(given))] >= 0.0:
        return []
    return [f"{history.name}: {rate} first goes against {history.input_name}: is one of the signs wrong?"]


def _signs(response: Response, key: str, axis: str, history: TimeHistory) -> list[str]:
    """An aircraft's rate begins in the direction of the command: a response that does not has a wrong sign somewhere. Of an angle
    it is that of its rate, i omega times as large, which an angle in phase (attitude command) or a quarter turn behind has."""
    if not _follows(history, axis):
        return []
    inner = response.response
    good = np.isfinite(inner.value) & (np.nan_to_num(inner.coherence) >= COHERENCE_MIN)
    rate = inner.value * (1j * inner.omega if (axis in RATE_AND_ATTITUDE and key == RATE_AND_ATTITUDE[axis][1]) else 1.0)
    if not good.any() or rate[good].real.sum() > 0.0:
        return []
    return [f"{key} answers against {history.input_name}: is one of the signs wrong? Bandwidths need a response that goes with it"]


def _sampling(response: Response, history: TimeHistory) -> list[str]:
    highest = float(response.response.omega[-1])
    samples = 2.0 * math.pi / (highest * history.dt)
    if samples >= FEW_SAMPLES:
        return []
    words = f"{response.title}: {samples:.3g} samples a period at {highest:.4g} rad/s"
    return [f"{words}: phase hangs on when in its interval each sample was taken"]
