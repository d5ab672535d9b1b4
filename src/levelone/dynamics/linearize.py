"""The closed loop linearised: derivatives of the map over one control period, cut at the rotor delay.

Over a period the airframe goes x+ = A x + B0 u(k-m-1) + B1 u(k-m), with y = C x at the tick; the controller goes
c+ = Ac c + Bc y + Br r, u = Cc c + Dc y + Dr r. The delay is closed at each frequency with z = exp(i omega T_c), so delay and
sampling are exact and the matrices stay small. Derivatives are central differences of the compiled maps, compared with those of
half the step. Source of the method: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 3rd ed., ch. 4 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from levelone.compiled import kernel
from levelone.dynamics.controller import COMMANDS, MODES, N_MEMORY, PHI_TRIM, Law, control
from levelone.dynamics.frames import euler_angles, quaternion
from levelone.dynamics.integrate import N_SENSORS, measure, period_map
from levelone.dynamics.model import N_STATE, Inputs, Plant, make_work, plants_of
from levelone.dynamics.simulate import check_before_flight, run_chunks, sensor_arrays, threads_of
from levelone.dynamics.trim import Trim, law_of, run_trim
from levelone.errors import InputError, unknown_name
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.manoeuvres import Manoeuvre
from levelone.status import Status
from levelone.vehicle import SENSOR_CHANNELS, Vehicle, VehicleBatch, batch_of
from levelone.vehicle.tables import FloatArray

ComplexArray = NDArray[np.complex128]
#: coordinates of the linear airframe: position, body velocity, Euler angles, body rates; with a motor lag the throttles follow
COORDINATES = ("north", "east", "down", "u", "v", "w", "phi", "theta", "psi", "p", "q", "r")
N_X = len(COORDINATES)
#: dynamic part of the controller's memory (what follows is constant in flight)
N_C = PHI_TRIM
X_STEPS = np.array([1e-2] * 3 + [1e-3] * 3 + [1e-4] * 3 + [1e-3] * 3)
U_STEP, Y_STEPS, R_STEP, C_STEP = 1e-4, np.array([1e-2] * 3 + [1e-3] * 3 + [1e-4] * 3 + [1e-3] * 3), 1e-3, 1e-3
#: largest change of a derivative at half the step, over the largest entry of its matrix, before the linearisation is refused
DIFFERENCE_LIMIT = 1e-4
FAILED = int(Status.LINEARISATION_FAILED)


@kernel
def to_coordinates(x, xi):
    """Coordinates of a state (``COORDINATES``)."""
    for j in range(6):
        xi[j] = x[j]
    xi[6], xi[7], xi[8] = euler_angles(x[6], x[7], x[8], x[9])
    xi[9], xi[10], xi[11] = x[10], x[11], x[12]


@kernel
def from_coordinates(xi, x):
    """State of given coordinates."""
    for j in range(6):
        x[j] = xi[j]
    x[6], x[7], x[8], x[9] = quaternion(xi[6], xi[7], xi[8])
    x[10], x[11], x[12] = xi[9], xi[10], xi[11]


@kernel
def airframe_map(plant, work, place, fraction, inputs, period, dt, n_x, out, y):
    """One period from ``place`` = (coordinates, rotors' throttles if lagged, old command, new command); also measures the start."""
    n = plant.wrench.shape[1]
    x = np.empty(N_STATE)
    from_coordinates(place, x)
    measure(x, y)
    old, new = place[n_x : n_x + n].copy(), place[n_x + n :].copy()
    throttles = np.empty((3, n))
    throttles[0] = place[N_X : N_X + n] if n_x > N_X else new
    period_map(plant, work, x, throttles, old, new, fraction, inputs, period, dt)
    to_coordinates(x, out)
    if n_x > N_X:
        out[N_X:n_x] = throttles[0]


@kernel
def differentiate(plants, states, throttles, wind, period, dt, n_x, steps, matrices, sensed, error):
    """A, B0, B1 side by side in ``matrices`` [runs, n_x, n_x + 2 rotors] and C in ``sensed`` for each airframe of a chunk."""
    scalars, wrench, cubics, rest = plants
    inputs = Inputs(0.0, (0.0, 0.0, 0.0), wind, (0.0, 0.0, 0.0))
    n_all = len(steps)
    up, down, y_up, y_down = np.empty(n_x), np.empty(n_x), np.empty(N_SENSORS), np.empty(N_SENSORS)
    for i in range(len(scalars)):
        plant = Plant(scalars[i], wrench[i], cubics[i], *rest)
        n = wrench.shape[2]
        work = make_work(plant)
        late = scalars[i].tau_d / period
        fraction = late - int(late)
        place = np.empty(n_all)
        to_coordinates(states[i], place)
        for block in range(N_X, n_all, n):
            place[block : block + n] = throttles[i]
        worst = 0.0
        for j in range(n_all):
            kept = place[j]
            for half in (0.5, 1.0):
                h = steps[j] * half
                place[j] = kept + h
                airframe_map(plant, work, place, fraction, inputs, period, dt, n_x, up, y_up)
                place[j] = kept - h
                airframe_map(plant, work, place, fraction, inputs, period, dt, n_x, down, y_down)
                place[j] = kept
                for r in range(n_x):
                    slope = (up[r] - down[r]) / (2.0 * h)
                    if half == 1.0:
                        worst = max(worst, abs(slope - matrices[i, r, j]))
                    matrices[i, r, j] = slope
                if j < n_x:
                    for r in range(N_SENSORS):
                        sensed[i, r, j] = (y_up[r] - y_down[r]) / (2.0 * h)
        error[i] = worst


@kernel
def differentiate_law(law, mode, speed, climb, start_memory, start_y, place, steps, out):
    """Derivatives of the controller's period, [memory then throttles, memory then measurements then commands]."""
    n_c, n = N_C, law.allocation.shape[0]
    memory, throttle = np.empty(N_MEMORY), np.empty(n)
    value = np.empty((2, n_c + n))
    for j in range(len(place)):
        for side in range(2):
            shifted = place.copy()
            shifted[j] += steps[j] if side == 0 else -steps[j]
            memory[:] = start_memory
            memory[:n_c] += shifted[:n_c]
            y = start_y + shifted[n_c : n_c + N_SENSORS]
            control(law, mode, shifted[n_c + N_SENSORS :].copy(), speed, climb, y, memory, throttle)
            value[side, :n_c] = memory[:n_c]
            value[side, n_c:] = throttle
        out[:, j] = (value[0] - value[1]) / (2.0 * steps[j])


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
    law
        The controller, the same for all.
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
    law: LinearLaw
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
        feedback, forward = self._law_response(z, COMMANDS.index(command))
        value = np.full((len(self.status), len(omega)), np.nan + 0j)
        good = np.flatnonzero(self.status == Status.OK)

        def work(part: slice) -> None:
            for run in good[part]:
                value[run] = self._respond(int(run), z, feedback, forward, SENSOR_CHANNELS.index(output))

        run_chunks(work, len(good), threads_of(threads), chunk)
        return FrequencyResponse(omega, value)

    def _law_response(self, z: ComplexArray, command: int) -> tuple[ComplexArray, ComplexArray]:
        """[nf, rotors, channels] feedback with the sensor unit, and [nf, rotors] feed-forward from the command."""
        law = self.law
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

    @cached_property
    def _reach(self) -> FloatArray:
        """[rotors, r] orthonormal basis of the throttle changes that the controller can send; past ones are kept in it."""
        u, size, _ = np.linalg.svd(np.hstack([self.law.C, self.law.D, self.law.Dr]))
        return u[:, : max(1, int(np.sum(size > 1e-10 * size[0])))]

    @cached_property
    def _kept(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Channels whose lag, and whose delay, needs states: only those that the controller reads."""
        read = np.any(self.law.B != 0.0, axis=0) | np.any(self.law.D != 0.0, axis=0)
        return np.flatnonzero(read & (self.lag_gain[:, 0] > 0.0)), np.flatnonzero(read & (self.sensor_delay > 0))

    def _lifted(self, run: int) -> FloatArray:
        """State matrix over (airframe, controller, past commands, sensor lags, past measurements)."""
        law, C, reach = self.law, self.C[run], self._reach
        n, c, u, m = self.A.shape[1], len(law.A), reach.shape[1], int(self.whole_delay[run]) + 1
        lags, delays = self._kept
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
        n, c, reach, size = self.A.shape[1], len(self.law.A), self._reach, len(self._lifted(run))
        drive, read = np.zeros(size), np.zeros(size)
        direct = reach.T @ self.law.Dr[:, command]
        if self.whole_delay[run] == 0:
            drive[:n] = self.B1[run] @ reach @ direct
        drive[n : n + c] = self.law.Br[:, command]
        drive[n + c : n + c + len(direct)] = direct
        read[:n] = self.C[run, output]
        return drive, read


def linearize(
    vehicles: Vehicle | VehicleBatch,
    speed: float,
    *,
    flight_mode: str = "velocity",
    climb: float = 0.0,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    dt: float = 0.004,
    threads: int | None = None,
) -> LinearModel:
    """Linearise the closed loop about a trim.

    Parameters
    ----------
    vehicles
        One vehicle or a batch.
    speed, climb, wind
        The trim: ground speed and climb rate (m/s), steady wind towards north, east, down (m/s).
    flight_mode
        Which loops are closed: ``"rate"``, ``"attitude"``, ``"velocity"`` or ``"position"``.
    dt
        Integration step, s.

    Returns
    -------
    LinearModel
        Runs that cannot be trimmed, or whose differences do not settle, say so in ``status``.

    Raises
    ------
    InputError
        Unknown flight mode, and what :func:`levelone.dynamics.simulate.simulate` refuses.
    """
    batch = batch_of(vehicles)
    if flight_mode not in MODES:
        raise unknown_name("flight_mode", flight_mode, MODES)
    controller = batch.nominal.controller
    axis = {"rate": "q", "attitude": "theta"}.get(flight_mode, "V_lon")
    hold = Manoeuvre("trim", flight_mode, axis, speed, climb, "none", dt=dt, controller_rate=controller.rate, wind=wind)  # type: ignore[arg-type]
    check_before_flight(batch, hold)
    law = law_of(batch.nominal)
    n, n_u = len(batch), batch.nominal.n_rotors
    n_x = N_X + (n_u if batch.scalars["motor_lag"].max() > 0 else 0)
    matrices, sensed, error = np.empty((n, n_x, n_x + 2 * n_u)), np.empty((n, N_SENSORS, n_x)), np.empty(n)
    steps = np.concatenate([X_STEPS, np.full(n_x - N_X + 2 * n_u, U_STEP)])
    start = run_trim(batch, law, np.full(n, float(speed)), float(climb), wind)
    status = start.status
    *differing, shared = plants_of(batch)

    def work(part: slice) -> None:
        plants = (*(array[part] for array in differing), shared)
        at = (start.state[part], start.throttle[part], wind, controller.period, dt)
        differentiate(plants, *at, n_x, steps, matrices[part], sensed[part], error[part])

    run_chunks(work, n, threads_of(threads), 32)
    error /= np.abs(matrices).max(axis=(1, 2))
    bad = (status == Status.OK) & ~((error < DIFFERENCE_LIMIT) & np.isfinite(matrices).all(axis=(1, 2)))
    status[bad] = FAILED
    nominal = run_trim(batch_of(batch.nominal), law, np.full(1, float(speed)), float(climb), wind)
    gain, late = sensor_arrays(batch.nominal.sensors, controller.period)
    return LinearModel(
        A=matrices[:, :, :n_x], B0=matrices[:, :, n_x : n_x + n_u], B1=matrices[:, :, n_x + n_u :], C=sensed,
        law=linear_law(law, MODES.index(flight_mode), nominal, float(speed), float(climb)), delay=batch.scalars["tau_d"],
        lag_gain=gain, sensor_delay=late, period=controller.period, difference_error=error, status=status,
    )  # fmt: skip


def linear_law(law: Law, mode: int, start: Trim, speed: float, climb: float) -> LinearLaw:
    """Derivatives of the controller at the first good trim; inside its limits it is the same for every airframe."""
    first = int(np.argmax(start.status == Status.OK))
    y = np.empty(N_SENSORS)
    measure(start.state[first], y)
    n_u, n_r = len(law.allocation), len(COMMANDS)
    steps = np.concatenate([np.full(N_C, C_STEP), Y_STEPS, np.full(n_r, R_STEP)])
    place = np.zeros(len(steps))
    out = np.empty((N_C + n_u, len(steps)))
    differentiate_law(law, mode, speed, climb, start.memory[first], y, place, steps, out)
    a, b = N_C, N_C + N_SENSORS
    return LinearLaw(out[:a, :a], out[:a, a:b], out[:a, b:], out[a:, :a], out[a:, a:b], out[a:, b:])
