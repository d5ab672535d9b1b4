"""What a linearisation gives: frequency responses with the delay closed exactly, and poles with it lifted into states.

Matrices and the scheme of the cut are those of :mod:`levelone.dynamics.linearize`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from levelone.dynamics.controller import COMMANDS
from levelone.dynamics.simulate import run_chunks, threads_of
from levelone.errors import InputError, unknown_name
from levelone.handling.frequency import FrequencyResponse
from levelone.status import Status
from levelone.vehicle import SENSOR_CHANNELS
from levelone.vehicle.tables import FloatArray

ComplexArray = NDArray[np.complex128]


def check_names(command: str, output: str) -> None:
    """Refuse a command or an output that does not exist."""
    for field, name, allowed in (("command", command, COMMANDS), ("output", output, SENSOR_CHANNELS)):
        if name not in allowed:
            raise unknown_name(field, name, allowed)


class LinearLaw(NamedTuple):
    """The controller's period: c+ = A c + B y + Br r, u = C c + D y + Dr r."""

    A: FloatArray
    B: FloatArray
    Br: FloatArray
    C: FloatArray
    D: FloatArray
    Dr: FloatArray


@dataclass(frozen=True)
class Poles:
    """Poles of the sampled closed loop.

    ``s`` are log(z) / T_c (1/s) of those that are not delay; ``z`` all of them; ``delay`` marks those at z = 0, whose s does not
    exist: what a pure delay, or a memory that is written anew each period, adds.
    """

    s: ComplexArray
    z: ComplexArray
    delay: NDArray[np.bool_]

    @property
    def omega_n(self) -> FloatArray:
        """Natural frequency of each pole in ``s``, rad/s."""
        return np.abs(self.s)

    @property
    def zeta(self) -> FloatArray:
        """Damping ratio of each pole in ``s``; NaN for one at the origin."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.omega_n > 1e-9, -self.s.real / self.omega_n, np.nan)


@dataclass(frozen=True)
class LinearModel:
    """The closed loop about a trim, for each airframe of a batch.

    Parameters
    ----------
    A, B0, B1, C
        [runs, n, n], [runs, n, rotors] (old and new command), [runs, channels, n].
    laws, which
        The controllers, and [runs] which one closes each loop.
    delay
        [runs] rotor delay, s.
    lag_gain, sensor_delay
        Sensor unit, see :func:`levelone.dynamics.simulate.sensor_arrays`.
    period
        Control period, s.
    difference_error
        [runs] largest change of a derivative at half the step, over the largest entry of the matrix.
    status
        [runs].
    """

    A: FloatArray
    B0: FloatArray
    B1: FloatArray
    C: FloatArray
    laws: tuple[LinearLaw, ...]
    which: NDArray[np.int64]
    delay: FloatArray
    lag_gain: FloatArray
    sensor_delay: NDArray[np.int64]
    period: float
    difference_error: FloatArray
    status: NDArray[np.int64]

    @cached_property
    def whole_delay(self) -> NDArray[np.int64]:
        """[runs] whole control periods of the delay."""
        return np.floor(self.delay / self.period).astype(np.int64)

    def frequency_response(
        self, command: str, output: str, omega: FloatArray, chunk: int = 8, threads: int | None = None
    ) -> FrequencyResponse:
        """Response of a measured channel (before the sensor unit) to a command, both sampled at the control rate.

        Parameters
        ----------
        command
            One of ``COMMANDS``: ``"V_lon"``, ``"theta"`` ...
        output
            One of ``SENSOR_CHANNELS``: ``"q"``, ``"theta"``, ``"V_lon"`` ...
        omega
            [nf] rad/s, below the Nyquist frequency pi / T_c.

        Returns
        -------
        FrequencyResponse
            ``value`` [runs, nf]; NaN for a run whose status is not ok.

        Raises
        ------
        InputError
            Unknown names, frequencies at or beyond Nyquist.
        """
        check_names(command, output)
        omega = np.asarray(omega, dtype=float)
        if omega.max() >= np.pi / self.period:
            raise InputError("omega", f"{omega.max():.4g} rad/s reaches the Nyquist frequency of {np.pi / self.period:.4g} rad/s")
        z = np.exp(1j * omega * self.period)
        answers = [self._law_response(law, z, COMMANDS.index(command)) for law in self.laws]
        value = np.full((len(self.status), len(omega)), np.nan + 0j)
        good = np.flatnonzero(self.status == Status.OK)

        def work(part: slice) -> None:
            for run in good[part]:
                feedback, forward = answers[self.which[run]]
                value[run] = self._respond(int(run), z, feedback, forward, SENSOR_CHANNELS.index(output))

        run_chunks(work, len(good), threads_of(threads), chunk)
        return FrequencyResponse(omega, value)

    def _law_response(self, law: LinearLaw, z: ComplexArray, command: int) -> tuple[ComplexArray, ComplexArray]:
        """[nf, rotors, channels] feedback with the sensor unit, and [nf, rotors] feed-forward from the command."""
        resolvent = np.linalg.inv(z[:, None, None] * np.eye(len(law.A)) - law.A)
        a, b0, b1 = self.lag_gain.T
        sensor = (b1 + (a * b1 + b0) / (z[:, None] - a)) * z[:, None] ** -self.sensor_delay
        feedback: ComplexArray = (law.C @ resolvent @ law.B + law.D) * sensor[:, None, :]
        forward = (law.C @ resolvent @ law.Br[:, command, None])[..., 0] + law.Dr[:, command]
        return feedback, np.asarray(forward, dtype=np.complex128)

    def _respond(self, run: int, z: ComplexArray, feedback: ComplexArray, forward: ComplexArray, output: int) -> ComplexArray:
        late = z ** -float(self.whole_delay[run])
        B = (self.B0[run] / z[:, None, None] + self.B1[run]) * late[:, None, None]
        closed = z[:, None, None] * np.eye(self.A.shape[1]) - self.A[run] - B @ (feedback @ self.C[run])
        state = np.linalg.solve(closed, B @ forward[..., None])
        return (self.C[run, output] @ state)[:, 0]

    def poles(self, run: int = 0) -> Poles:
        """Poles with the delay and the sensor unit lifted into states."""
        z: ComplexArray = np.linalg.eigvals(self._lifted(run)).astype(np.complex128)
        delay = np.abs(z) < 1e-3
        s: ComplexArray = np.asarray(np.log(z[~delay]) / self.period, dtype=np.complex128)
        return Poles(s, z, delay)

    def dominant(self, command: str, output: str, run: int = 0) -> complex:
        """The oscillatory pole that overshoots most from ``command`` to ``output``, in 1/s; NaN where there is none.

        The overshoot is the pole's share in the answer to a step, its residue over (1 - z), after half a period of its own. The
        share alone would do where poles are well apart; but two fast ones that are about to meet have large shares that cancel.
        """
        # left vectors of their own: those of the poles at z = 0 are not independent, and the right ones have no inverse
        z, left, right = eig(self._lifted(run), left=True)  # type: ignore[misc]
        drive, read = self._lifted_ports(run, COMMANDS.index(command), SENSOR_CHANNELS.index(output))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            overlap = np.einsum("ij,ij->j", left.conj(), right)
            share = np.abs((read @ right) * (left.conj().T @ drive) / overlap / (1.0 - z))
            s = np.log(z.astype(complex)) / self.period
            overshoot = share * np.exp(np.pi * s.real / s.imag)
        overshoot = np.where((z.imag > 1e-6) & (np.abs(z) > 1e-3), overshoot, 0.0)
        return complex(s[np.argmax(overshoot)]) if overshoot.max() > 0 else complex(np.nan, np.nan)

    def law(self, run: int = 0) -> LinearLaw:
        """The controller of one run."""
        return self.laws[self.which[run]]

    @staticmethod
    def _reach(law: LinearLaw) -> FloatArray:
        """[rotors, r] orthonormal basis of the throttle changes that the controller can send; past ones are kept in it."""
        u, size, _ = np.linalg.svd(np.hstack([law.C, law.D, law.Dr]))
        return u[:, : max(1, int(np.sum(size > 1e-10 * size[0])))]

    def _kept(self, law: LinearLaw) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Channels whose lag, and whose delay, needs states: only those that the controller reads."""
        read = np.any(law.B != 0.0, axis=0) | np.any(law.D != 0.0, axis=0)
        return np.flatnonzero(read & (self.lag_gain[:, 0] > 0.0)), np.flatnonzero(read & (self.sensor_delay > 0))

    def _lifted(self, run: int) -> FloatArray:
        """State matrix over (airframe, controller, past commands, sensor lags, past measurements)."""
        law, C = self.law(run), self.C[run]
        reach = self._reach(law)
        n, c, u, m = self.A.shape[1], len(law.A), reach.shape[1], int(self.whole_delay[run]) + 1
        lags, delays = self._kept(law)
        a, b0, b1 = self.lag_gain.T
        o_u, o_s = n + c, n + c + m * u
        starts = o_s + len(lags) + np.concatenate([[0], np.cumsum(self.sensor_delay[delays])]).astype(int)
        size = starts[-1]
        matrix = np.zeros((size, size))
        # what leaves the lags, and what the controller sees of it, as rows over the lifted state
        lagged = np.zeros((len(C), size))
        lagged[:, :n] = b1[:, None] * C
        lagged[lags, o_s + np.arange(len(lags))] = 1.0
        seen = lagged.copy()
        for first, end, channel in zip(starts[:-1], starts[1:], delays, strict=True):
            seen[channel] = 0.0
            seen[channel, end - 1] = 1.0
            matrix[first] = lagged[channel]
            matrix[first + 1 : end, first : end - 1] = np.eye(end - first - 1)
        now = reach.T @ law.D @ seen
        now[:, n:o_u] += reach.T @ law.C
        past = [now] + [np.eye(size)[o_u + i * u : o_u + (i + 1) * u] for i in range(m)]
        matrix[:n, :n] = self.A[run]
        matrix[:n] += self.B1[run] @ reach @ past[m - 1] + self.B0[run] @ reach @ past[m]
        matrix[n:o_u] = law.B @ seen
        matrix[n:o_u, n:o_u] += law.A
        for i in range(m):
            matrix[o_u + i * u : o_u + (i + 1) * u] = past[i]
        matrix[o_s : starts[0]] = a[lags, None] * lagged[lags]
        matrix[o_s : starts[0], :n] += b0[lags, None] * C[lags]
        return matrix

    def _lifted_ports(self, run: int, command: int, output: int) -> tuple[FloatArray, FloatArray]:
        """Column by which the command enters the lifted state, and row that reads the output."""
        law = self.law(run)
        n, c, reach, size = self.A.shape[1], len(law.A), self._reach(law), len(self._lifted(run))
        drive, read = np.zeros(size), np.zeros(size)
        direct = reach.T @ law.Dr[:, command]
        if self.whole_delay[run] == 0:
            drive[:n] = self.B1[run] @ reach @ direct
        drive[n : n + c] = law.Br[:, command]
        drive[n + c : n + c + len(direct)] = direct
        read[:n] = self.C[run, output]
        return drive, read
