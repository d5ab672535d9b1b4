"""The closed loop linearised: derivatives of the map over one control period, cut at the rotor delay.

Over a period the airframe goes x+ = A x + B0 u(k-m-1) + B1 u(k-m), with y = C x at the tick; the controller goes
c+ = Ac c + Bc y + Br r, u = Cc c + Dc y + Dr r. The delay is closed at each frequency with z = exp(i omega T_c), so delay and
sampling are exact and the matrices stay small. Derivatives are central differences of the compiled maps, compared with those of
half the step. Source of the method: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 3rd ed., ch. 4 and 6.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from levelone.compiled import kernel
from levelone.dynamics.controller import COMMANDS, MODES, N_MEMORY, PHI_TRIM, Law, control
from levelone.dynamics.frames import euler_angles, quaternion
from levelone.dynamics.integrate import N_SENSORS, measure, period_map
from levelone.dynamics.linear_model import LinearLaw, LinearModel
from levelone.dynamics.model import N_STATE, Inputs, Plant, make_work, plants_of
from levelone.dynamics.simulate import check_before_flight, run_chunks, sensor_arrays, threads_of
from levelone.dynamics.trim import Trim, law_of, laws_of, run_trim, stacked
from levelone.errors import unknown_name
from levelone.handling.manoeuvres import Manoeuvre
from levelone.status import Status
from levelone.vehicle import Vehicle, VehicleBatch, batch_of

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
    laws = laws_of(batch)
    n, n_u = len(batch), batch.nominal.n_rotors
    n_x = N_X + (n_u if batch.scalars["motor_lag"].max() > 0 else 0)
    matrices, sensed, error = np.empty((n, n_x, n_x + 2 * n_u)), np.empty((n, N_SENSORS, n_x)), np.empty(n)
    steps = np.concatenate([X_STEPS, np.full(n_x - N_X + 2 * n_u, U_STEP)])
    start = run_trim(batch, laws, np.full(n, float(speed)), float(climb), wind)
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
    linear = linear_laws(batch, MODES.index(flight_mode), (float(speed), float(climb), wind))
    known = np.array([bool(np.isfinite(law.D).all()) for law in linear])
    status[(status == Status.OK) & ~known[batch.which]] = FAILED
    gain, late = sensor_arrays(batch.nominal.sensors, controller.period)
    return LinearModel(
        A=matrices[:, :, :n_x], B0=matrices[:, :, n_x : n_x + n_u], B1=matrices[:, :, n_x + n_u :], C=sensed,
        laws=linear, which=batch.which, delay=batch.scalars["tau_d"],
        lag_gain=gain, sensor_delay=late, period=controller.period, difference_error=error, status=status,
    )  # fmt: skip


def linear_laws(
    batch: VehicleBatch, mode: int, condition: tuple[float, float, tuple[float, float, float]]
) -> tuple[LinearLaw, ...]:
    """Derivatives of each controller at the trim of the vehicle it was designed for; inside its limits they hold everywhere.

    NaN where that vehicle has no such trim.
    """
    speed, climb, wind = condition
    found = []
    for controller in batch.controllers:
        design = batch_of(replace(batch.nominal, airframe=controller.design, controller=controller))
        law = law_of(design.nominal)
        start = run_trim(design, stacked([law], design.which), np.full(1, speed), climb, wind)
        good = start.status[0] == Status.OK
        found.append(linear_law(law, mode, start, speed, climb) if good else None)
    return tuple(undefined_law(batch) if law is None else law for law in found)


def undefined_law(batch: VehicleBatch) -> LinearLaw:
    """A controller whose derivatives are not known: NaN."""
    n_u, n_y, n_r = batch.nominal.n_rotors, N_SENSORS, len(COMMANDS)
    return LinearLaw(*(np.full((rows, columns), np.nan) for rows in (N_C, n_u) for columns in (N_C, n_y, n_r)))


def linear_law(law: Law, mode: int, start: Trim, speed: float, climb: float) -> LinearLaw:
    """Derivatives of a controller about the first trim in ``start``."""
    y = np.empty(N_SENSORS)
    measure(start.state[0], y)
    n_u, n_r = len(law.allocation), len(COMMANDS)
    steps = np.concatenate([np.full(N_C, C_STEP), Y_STEPS, np.full(n_r, R_STEP)])
    place = np.zeros(len(steps))
    out = np.empty((N_C + n_u, len(steps)))
    differentiate_law(law, mode, speed, climb, start.memory[0], y, place, steps, out)
    a, b = N_C, N_C + N_SENSORS
    return LinearLaw(out[:a, :a], out[:a, a:b], out[:a, b:], out[a:, :a], out[a:, a:b], out[a:, b:])
