"""Time response of a linear system with delays to an input that is held from sample to sample.

Delays before and after the system: exact at the samples, whatever the interval. Within a sample the input changes once, where its
fractional delay ends; both parts are integrated by the matrix exponential (Franklin, Powell and Workman, *Digital Control of
Dynamic Systems*, 3rd ed., section 4.3.3, systems with delay), and outputs that are late are read between the samples.

Delays inside a loop: the method of steps. What left the loop in the past is a cubic between stored values and slopes, and is
integrated exactly against the matrix exponential; no stiffness of actuators limits the step. The order is four where every delay
is a multiple of the step, and two where a corner of the past falls within one. Steps divide the sampling interval by a number
up to ``MOST`` at which the delays are multiples of them, or by ``MOST`` where there is no such number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from levelone.compiled import kernel
from levelone.dynamics.feedback import DelayedSystem, FloatArray
from levelone.errors import InputError

#: most steps in one sampling interval, and most where a delay is shorter than that
MOST = 16
FINEST = 256
#: largest step times the fastest pole of the system, up to MOST steps
_FASTEST = 0.5
_SAME = 1e-9


class _Delay(NamedTuple):
    """A delay as whole samples and a rest within one, s."""

    whole: int
    rest: float


def _split(delay: float, dt: float) -> _Delay:
    whole = int(np.floor(delay / dt + _SAME))
    rest = delay - whole * dt
    return _Delay(whole, rest if rest > _SAME * dt else 0.0)


def _shifted(u: FloatArray, samples: int) -> FloatArray:
    """The input some samples later, trim (zero) before."""
    return np.concatenate([np.zeros(min(samples, len(u))), u[: max(len(u) - samples, 0)]])


def _held(A: FloatArray, b: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
    """exp(A t), and what a unit input through b held for t adds."""
    n = len(A)
    both = expm(np.block([[A, b[:, None]], [np.zeros((1, n + 1))]]) * time)
    return both[:n, :n], both[:n, n]


class _Forcing(NamedTuple):
    """A piecewise constant input through one column: [n] shares of the older and the newer value in a sample, and those values."""

    older: FloatArray
    newer: FloatArray
    u_older: FloatArray
    u_newer: FloatArray
    column: FloatArray
    changes: bool
    """Whether the value changes within a sample, and not at its beginning."""


def _forcing(A: FloatArray, b: FloatArray, u: FloatArray, delay: float, dt: float) -> _Forcing:
    late = _split(delay, dt)
    whole, newer = _held(A, b, dt)[1], _held(A, b, dt - late.rest)[1]
    return _Forcing(whole - newer, newer, _shifted(u, late.whole + 1), _shifted(u, late.whole), b, late.rest > 0.0)


def time_response(system: DelayedSystem, column: int, u: FloatArray, dt: float) -> FloatArray:
    """Outputs [p, samples] from rest, at the samples, with ``u`` [samples] held from each to the next.

    Parameters
    ----------
    system
        Any units; outputs are changes from trim in its own.
    column
        The input that moves.
    u
        Its change from trim at 0, dt, 2 dt ...
    dt
        s.

    Raises
    ------
    InputError
        A delay inside a loop is very much shorter than the sampling interval.
    """
    u = np.asarray(u, dtype=np.float64)
    values = _late(system, column, u, dt) if len(system.loop_delay) else _exact(system, column, u, dt)
    # what goes straight through, a delay inside or not, jumps with the input: it is read at its own moments and not in between
    for row, delay in enumerate(system.output_delay):
        late = _split(float(system.input_delay[column] + delay), dt)
        values[row] += system.D[row, column] * _shifted(u, late.whole + (1 if late.rest else 0))
        for share, inside in zip(system.D_y[row] * system.D_z[:, column], system.loop_delay, strict=True):
            late = _split(float(system.input_delay[column] + inside + delay), dt)
            values[row] += share * _shifted(u, late.whole + (1 if late.rest else 0))
    return values


def _exact(system: DelayedSystem, column: int, u: FloatArray, dt: float) -> FloatArray:
    """[p, samples] C x at the delays of the outputs, where no delay lies inside."""
    A, b = system.A, system.B[:, column]
    entry = _split(float(system.input_delay[column]), dt)
    forcing = _forcing(A, b, u, float(system.input_delay[column]), dt)
    states = _marched(_held(A, b, dt)[0], forcing)
    values = np.empty((len(system.C), len(u)))
    for row, delay in enumerate(system.output_delay):
        late, read = _split(float(delay), dt), states
        if late.rest:  # read between the samples: from the one before, by what is left of the interval
            between = dt - late.rest
            phi, held = _held(A, b, between)
            newer = _held(A, b, max(between - entry.rest, 0.0))[1]
            read = states @ phi.T + np.outer(forcing.u_older, held - newer) + np.outer(forcing.u_newer, newer)
        values[row] = _shifted(read @ system.C[row], late.whole + (1 if late.rest else 0))
    return values


def _marched(phi: FloatArray, forcing: _Forcing) -> FloatArray:
    """[samples, n] states from rest."""
    drive = np.outer(forcing.u_older, forcing.older) + np.outer(forcing.u_newer, forcing.newer)
    states = np.zeros_like(drive)
    with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges is seen in its outputs
        for k in range(len(drive) - 1):
            states[k + 1] = phi @ states[k] + drive[k]
    return states


def _late(system: DelayedSystem, column: int, u: FloatArray, dt: float) -> FloatArray:
    """[p, samples] C x and what of the states leaves the delays inside, at the delays of the outputs, by the method of steps."""
    steps = _steps_of(system, column, dt)
    h, fine = dt / steps, np.repeat(u, steps)
    smooth = _stepped(system, column, fine, h)
    time = h * np.arange(len(fine))
    return np.stack(
        [np.interp(time[::steps] - delay, time, row, left=0.0) for row, delay in zip(smooth, system.output_delay, strict=True)]
    )


def _steps_of(system: DelayedSystem, column: int, dt: float) -> int:
    """Steps in a sampling interval: the fewest at which the loop is resolved and all its delays are multiples."""
    delays = np.concatenate([system.loop_delay, system.input_delay[[column]]])
    shortest, fastest = float(system.loop_delay.min()), float(np.abs(np.linalg.eigvals(system.A)).max())
    needed = int(np.ceil(dt / shortest - _SAME))
    if needed > FINEST:
        raise InputError("delay", f"of {shortest:g} s inside the loop is below 1/{FINEST} of the sampling interval: leave it out")
    least = max(needed, min(int(np.ceil(dt * fastest / _FASTEST)), MOST), 1)
    for steps in range(least, max(MOST, least) + 1):
        parts = delays * steps / dt
        if np.abs(parts - np.round(parts)).max() < 1e-6:
            return steps
    return max(MOST, least)


def _stepped(system: DelayedSystem, column: int, u: FloatArray, h: float) -> FloatArray:
    """[p, steps] C x and what of the states leaves the delays inside, from rest."""
    A, before = system.A, float(system.input_delay[column])
    forcings = [_forcing(A, system.B[:, column], u, before, h)]
    for d in np.flatnonzero(system.D_z[:, column]):
        share = float(system.D_z[d, column])
        forcings.append(_forcing(A, share * system.B_z[:, d], u, before + float(system.loop_delay[d]), h))
    late = [_split(float(delay), h) for delay in system.loop_delay]
    weights = np.stack([_polynomial_weights(A, system.B_z[:, d], h) for d in range(len(late))])
    read, seen = _method_of_steps(
        np.ascontiguousarray(_held(A, system.B[:, column], h)[0]),
        np.stack([np.stack([each.older, each.newer]) for each in forcings]),
        np.stack([np.stack([each.u_older, each.u_newer]) for each in forcings]),
        np.stack([np.ascontiguousarray(each.column) for each in forcings]),
        np.array([0 if each.changes else 1 for each in forcings]),
        weights,
        *(np.ascontiguousarray(matrix) for matrix in (A, system.B_z.T, system.C_z, system.C)),
        np.array([each.whole for each in late]),
        np.array([each.rest / h for each in late]),
        h,
    )
    return (read + seen @ system.D_y.T).T


def _polynomial_weights(A: FloatArray, b: FloatArray, h: float) -> FloatArray:
    """[4, n] what values at 0, h/3, 2h/3 and h of an input through b, a cubic between them, add to the state in h."""
    n = len(A)
    chain = np.zeros((n + 4, n + 4))
    chain[:n, :n], chain[:n, n] = A * h, b * h
    chain[n : n + 3, n + 1 :] = np.eye(3)
    moments = expm(chain)[:n, n:]  # of 1, s, s^2 / 2, s^3 / 6 with s from 0 to 1
    powers = np.vander(np.arange(4) / 3.0, 4, increasing=True) / np.array([1.0, 1.0, 2.0, 6.0])
    return np.linalg.solve(powers.T, moments.T)


@kernel
def _method_of_steps(phi, shares, u, columns, at_begin, weights, A, B_z, C_z, C, whole, rest, h):
    """[steps, p] C x and [steps, d] delayed C_z x (compiled); see the module's text.

    ``u`` [forcings, older and newer, steps] enters by ``shares`` [forcings, older and newer, n] in a step; at its beginning the
    value ``at_begin`` (older or newer) acts through ``columns`` [forcings, n], at its end the newer.
    """
    steps, d, n = u.shape[2], len(whole), len(A)
    x, new, first, last = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    read, seen, past = np.zeros((steps, len(C))), np.zeros((steps, d)), np.zeros((4, d))
    value, begin, end = np.zeros((steps, d)), np.zeros((steps, d)), np.zeros((steps, d))
    for k in range(steps):
        for i in range(d):
            for j in range(4):
                past[j, i] = _recalled(value, begin, end, i, k - whole[i] - rest[i], j, h)
            seen[k, i] = past[0, i]
        _times(C, x, read[k])
        if k == steps - 1:
            break
        _times(A, x, first)
        _times(phi, x, new)
        for i in range(len(u)):
            for state in range(n):
                first[state] += u[i, at_begin[i], k] * columns[i, state]
                new[state] += u[i, 0, k] * shares[i, 0, state] + u[i, 1, k] * shares[i, 1, state]
        for i in range(d):
            for state in range(n):
                first[state] += past[0, i] * B_z[i, state]
                for j in range(4):
                    new[state] += past[j, i] * weights[i, j, state]
        x[:] = new
        _times(A, x, last)
        for i in range(len(u)):
            for state in range(n):
                last[state] += u[i, 1, k] * columns[i, state]
        for i in range(d):
            for state in range(n):
                last[state] += past[3, i] * B_z[i, state]
        _times(C_z, x, value[k + 1])
        _times(C_z, first, begin[k])
        _times(C_z, last, end[k])
    return read, seen


@kernel
def _times(matrix, x, out):
    """The product of a matrix and a vector, in place (compiled)."""
    for i in range(len(matrix)):
        out[i] = 0.0
        for j in range(len(x)):
            out[i] += matrix[i, j] * x[j]


@kernel
def _recalled(value, begin, end, i, start, j, h):
    """Signal i at a third j of the step that began ``start`` steps after the first, by the cubic of the step it left in."""
    moment = start + j / 3.0
    step = int(np.floor(moment + 1e-9))
    if j == 3 and moment - step < 1e-9:
        step -= 1  # the end of a step, not the beginning of the next
    if step < 0:
        return 0.0
    s, rise = moment - step, value[step + 1, i] - value[step, i]
    p, r = h * begin[step, i], h * end[step, i]
    return value[step, i] + s * (p + s * (3.0 * rise - 2.0 * p - r + s * (p + r - 2.0 * rise)))
