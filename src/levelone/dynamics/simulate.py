"""Closed-loop flight of one vehicle or a batch: trim, fly, and give a time history.

Trajectories are independent; chunks of them run on threads (the kernels release the interpreter), so results do not depend on the
number of threads or on the chunks.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from levelone.compiled import kernel
from levelone.dynamics.controller import COMMANDS, MODES, Law, Laws
from levelone.dynamics.integrate import BUFFER, CHANNELS, EXTREMES, fly
from levelone.dynamics.model import Plant, plants_of
from levelone.dynamics.pilot import pilot_numbers
from levelone.dynamics.trim import design_trim, laws_of, run_trim
from levelone.errors import InputError, unknown_name
from levelone.handling.history import TimeHistory
from levelone.handling.manoeuvres import Manoeuvre, Start
from levelone.handling.pilot import Pilot
from levelone.status import Status
from levelone.vehicle import Sensors, Vehicle, VehicleBatch, batch_of
from levelone.vehicle.tables import FloatArray

OK = int(Status.OK)
CHANNEL_UNITS = dict(
    zip(CHANNELS, ("m", "m", "m", "m/s", "m/s", "m/s", "rad", "rad", "rad", "rad/s", "rad/s", "rad/s",
                   "m/s", "m/s", "m/s", "m/s", "rad", "rad"), strict=True)
)  # fmt: skip
CHUNK = 32


@kernel
def fly_chunk(
    plants, laws, sensors, mode, commands, wind, pilot, starts, speed, climb, dt, rows, records, asked, extremes, status
):  # fmt: skip
    """Fly each airframe of a chunk from its trim; runs whose trim failed are left out.

    ``asked`` [runs, ticks] takes the pilot's command; it has no ticks where there is no pilot.
    """
    scalars, wrench, cubics, rest = plants
    states, memories, throttles = starts
    for i in range(len(scalars)):
        if status[i] != OK:
            records[i] = np.nan
            extremes[i] = np.nan
            asked[i] = np.nan
            continue
        plant = Plant(scalars[i], wrench[i], cubics[i], *rest)
        start = (states[i], memories[i], throttles[i])
        k = laws.which[i]
        law = Law(laws.gains[k], laws.pid[k], laws.allocation[k], laws.trim[k])
        status[i] = fly(
            plant, law, sensors, mode, commands, wind, pilot, start, speed, climb, dt, rows, records[i], asked[i], extremes[i]
        )  # fmt: skip


def sensor_arrays(sensors: Sensors, period: float) -> tuple[FloatArray, NDArray[np.int64]]:
    """[channels, 3] coefficients of each lag (exact for a signal linear between ticks) and [channels] delays in ticks."""
    gain = np.zeros((len(sensors.lag), 3))
    gain[:, 2] = 1.0
    for row, lag in zip(gain, sensors.lag, strict=True):
        if lag > 0.0:
            a = float(np.exp(-period / lag))
            ramp = lag / period * (1.0 - a)
            row[:] = a, ramp - a, 1.0 - ramp
    return gain, np.asarray(sensors.delay, dtype=np.int64)


def command_table(manoeuvre: Manoeuvre) -> FloatArray:
    """[ticks, COMMANDS] changes of the commands from trim; in position mode the held position moves with the commanded velocity."""
    time = manoeuvre.ticks()
    change = manoeuvre.command(time)
    table = np.zeros((len(time), len(COMMANDS)))
    table[:, COMMANDS.index(manoeuvre.axis)] = change
    if manoeuvre.flight_mode == "position":
        moved = {"V_lon": "x_north", "V_lat": "y_east"}
        table[:, COMMANDS.index("x_north")] = manoeuvre.trim_speed * time
        if manoeuvre.axis in moved:
            table[1:, COMMANDS.index(moved[manoeuvre.axis])] += np.cumsum(change[:-1]) / manoeuvre.controller_rate
    return table


def wind_table(manoeuvre: Manoeuvre, gust: FloatArray | None) -> FloatArray:
    """[1 or ticks, 3] wind north, east, down, m/s."""
    steady = np.array([manoeuvre.wind], dtype=float)
    if gust is None:
        return steady
    gust = np.asarray(gust, dtype=float)
    if gust.shape != (len(manoeuvre.ticks()), 3) or not np.all(np.isfinite(gust)):
        raise InputError("gust", f"must be finite numbers of shape {(len(manoeuvre.ticks()), 3)}, got {gust.shape}")
    return steady + gust


def check_before_flight(batch: VehicleBatch, manoeuvre: Manoeuvre) -> None:
    """Refuse what no run of the batch could survive.

    Raises
    ------
    InputError
        A flight mode that the controller does not have, a delay longer than the buffer, a controller rate that is not the
        vehicle's, a speed beyond the rotor table.
    """
    controller = batch.nominal.controller
    if manoeuvre.flight_mode not in MODES:
        raise unknown_name("manoeuvre.flight_mode", manoeuvre.flight_mode, MODES)
    if abs(manoeuvre.controller_rate / controller.rate - 1.0) > 1e-9:
        raise InputError(
            "manoeuvre.controller_rate",
            f"{manoeuvre.controller_rate} Hz, but the vehicle's controller runs at {controller.rate} Hz",
        )
    longest = float(batch.scalars["tau_d"].max())
    if longest > BUFFER * controller.period:
        raise InputError("rotors.tau_d", f"{longest} s is longer than the delay buffer of {BUFFER * controller.period} s")
    air = np.array([manoeuvre.trim_speed, 0.0, -manoeuvre.trim_climb]) - np.array(manoeuvre.wind)
    reach = float(batch.nominal.airframe.rotors.table.airspeed[-1])
    if np.linalg.norm(air) * batch.scalars["T_u"].max() > reach:
        raise InputError(
            "manoeuvre.trim_speed", f"airspeed {np.linalg.norm(air):.4g} m/s exceeds the rotor table's {reach:.4g} m/s"
        )
    knots = batch.knots
    if len(knots) > 1 and np.linalg.norm(air) > knots[-1]:
        raise InputError(
            "manoeuvre.trim_speed",
            f"airspeed {np.linalg.norm(air):.4g} m/s exceeds the aerodynamic tables' {knots[-1]:.4g} m/s",
        )


def channel_names(vehicle: Vehicle) -> tuple[str, ...]:
    """Every channel that a simulation of the vehicle can record."""
    return CHANNELS + tuple(f"throttle_{i + 1}" for i in range(vehicle.n_rotors))


def threads_of(threads: int | None) -> int:
    """Number of worker threads: as asked, or one for each processor that this process may use."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return threads or available or 1


def simulate(
    vehicles: Vehicle | VehicleBatch | Sequence[Vehicle],
    manoeuvre: Manoeuvre,
    *,
    channels: Sequence[str] | None = None,
    gust: FloatArray | None = None,
    pilot: Pilot | None = None,
    start: Start = "own trim",
    threads: int | None = None,
    chunk: int = CHUNK,
) -> TimeHistory:
    """Fly a manoeuvre from trim.

    Parameters
    ----------
    vehicles
        One vehicle, several as :func:`levelone.vehicle.batch_of` takes them, or a batch.
    manoeuvre
        What is commanded; its ``wind`` is steady.
    channels
        Which channels to keep (see :func:`channel_names`); all by default.
    gust
        [ticks, 3] wind on top of the steady one, north, east, down, m/s, linear between ticks.
    pilot
        Decelerates to a point ahead from the manoeuvre's ``on``; the manoeuvre holds its trim otherwise (shape "none", velocity
        mode, no steady wind needed). ``V_lon_ref`` of the record is then what the pilot commanded, [run, time].
    start
        "own trim": each vehicle begins in the trim that its own numbers give. "design trim": all begin as the vehicle for which
        the controller was designed would, as where trims come out of a table made beforehand; others then drift until the
        controller has found their trim.
    threads, chunk
        How the batch is worked off; no influence on the results.

    Returns
    -------
    TimeHistory
        One run for each vehicle, sampled at the controller's rate. Runs that could not be trimmed or diverged hold NaN and say so
        in ``status``.

    Raises
    ------
    InputError
        For what would fail in every run: see :func:`check_before_flight` and :func:`levelone.dynamics.pilot.pilot_numbers`.
    """
    batch = batch_of(vehicles)
    check_before_flight(batch, manoeuvre)
    hand = pilot_numbers(pilot, manoeuvre, batch.nominal.controller.period)
    names = channel_names(batch.nominal)
    wanted = tuple(channels) if channels is not None else names
    for name in wanted:
        if name not in names:
            raise unknown_name("channels", name, names)
    time = manoeuvre.ticks()
    rows = np.array([names.index(name) for name in wanted], dtype=np.int64)
    n = len(batch)
    records, extremes = np.empty((n, len(wanted), len(time))), np.empty((n, len(EXTREMES)))
    asked = np.empty((n, len(time) if pilot is not None else 0))
    laws = laws_of(batch)
    wind = wind_table(manoeuvre, gust)
    here = (float(wind[0, 0]), float(wind[0, 1]), float(wind[0, 2]))
    sensors = sensor_arrays(batch.nominal.sensors, batch.nominal.controller.period)
    condition = (float(manoeuvre.trim_speed), float(manoeuvre.trim_climb), float(manoeuvre.dt))
    given = (sensors, MODES.index(manoeuvre.flight_mode), command_table(manoeuvre), wind, hand)
    if start == "own trim":
        begin = run_trim(batch, laws, np.full(n, condition[0]), condition[1], here)
    else:
        begin = design_trim(batch, laws, condition[0], condition[1], here)
    *differing, shared = plants_of(batch)

    def work(part: slice) -> None:
        plants = (*(array[part] for array in differing), shared)
        starts = (begin.state[part], begin.memory[part], begin.throttle[part])
        flown = (records[part], asked[part], extremes[part], begin.status[part])
        fly_chunk(plants, select_laws(laws, part), *given, starts, *condition, rows, *flown)

    run_chunks(work, n, threads_of(threads), chunk)
    history = _history(batch, manoeuvre, wanted, records, extremes, begin.status)
    return history if pilot is None else replace(history, channels={**history.channels, "V_lon_ref": asked})


def select_laws(laws: Laws, part: slice) -> Laws:
    """The controllers of some of the runs."""
    return laws._replace(which=laws.which[part])


def run_chunks(work: Callable[[slice], None], n: int, threads: int, chunk: int) -> None:
    """Call ``work`` on every chunk of ``range(n)``, on threads if there is more than one chunk."""
    parts = list(chunks(n, chunk))
    if threads == 1 or len(parts) == 1:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, parts))


def chunks(n: int, size: int) -> Iterator[slice]:
    """Consecutive slices of at most ``size`` that cover ``range(n)``."""
    return (slice(first, min(first + size, n)) for first in range(0, n, size))


def _history(
    batch: VehicleBatch,
    manoeuvre: Manoeuvre,
    wanted: tuple[str, ...],
    records: FloatArray,
    extremes: FloatArray,
    status: NDArray[np.int64],
) -> TimeHistory:
    n = len(status)
    time = manoeuvre.ticks()
    base = {"V_lon": manoeuvre.trim_speed, "V_vert": manoeuvre.trim_climb}.get(manoeuvre.axis, 0.0)
    reference = f"{manoeuvre.axis}_ref"
    units = {name: CHANNEL_UNITS.get(name, "1") for name in wanted} | {reference: manoeuvre.unit}
    flown = {name: records[:, row] for row, name in enumerate(wanted)}
    trim = {name: records[:, row, 0] for row, name in enumerate(wanted)} | {reference: np.full(n, base)}
    flown[reference] = np.broadcast_to(base + manoeuvre.command(time), (n, len(time)))
    stays = not np.isfinite(manoeuvre.off)
    lag = float(np.max(batch.nominal.sensors.delay)) * batch.nominal.controller.period
    return TimeHistory(
        time=time,
        channels=flown,
        units=units,
        trim=trim,
        input_name=reference,
        input_on=manoeuvre.on,
        input_off=float("nan") if stays else float(manoeuvre.off),
        delay=batch.scalars["tau_d"] + lag,
        wind=manoeuvre.wind,
        status=status,
        extremes=dict(zip(EXTREMES, extremes.T, strict=True)),
        name=manoeuvre.name,
    )
