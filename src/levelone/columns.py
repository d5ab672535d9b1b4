"""Results of the command as columns: SI and rad for files, four digits and degrees for the eye."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from levelone.config.manoeuvres import held_trim
from levelone.dynamics import LinearModel, Trim
from levelone.dynamics.controller import COMMANDS
from levelone.dynamics.simulate import check_before_flight
from levelone.dynamics.trim import AXES
from levelone.errors import InputError, unknown_name
from levelone.handling.axes import RotationAxis
from levelone.handling.damping import dynamic_stability
from levelone.handling.history import TimeHistory
from levelone.handling.levels import Level
from levelone.handling.manoeuvres import Manoeuvre
from levelone.handling.quickness import attitude_quickness
from levelone.status import Status
from levelone.vehicle import SENSOR_CHANNELS, Vehicle, batch_of

Columns = dict[str, Sequence[Any]]
ROTATION: dict[str, RotationAxis] = {
    "V_lon": "pitch",
    "theta": "pitch",
    "q": "pitch",
    "V_lat": "roll",
    "phi": "roll",
    "p": "roll",
    "yaw_rate": "yaw",
}
"""Rotation that a command is judged by; a climb has none."""


def check_speeds(vehicle: Vehicle, speeds: Sequence[float], climb: float) -> None:
    """Refuse a speed beyond the vehicle's tables: InputError."""
    for speed in speeds:
        check_before_flight(batch_of(vehicle), held_trim(vehicle.controller, speed, climb))


def trim_record(speeds: Sequence[float], climb: float, found: Sequence[Trim]) -> Columns:
    """Trims with the residual of each axis; a failed one is NaN."""
    attitude, throttle, good = _trims(found)
    columns: Columns = {"speed[m/s]": speeds, "climb[m/s]": [climb] * len(speeds)}
    columns |= {"theta[rad]": attitude[:, 0].tolist(), "phi[rad]": attitude[:, 1].tolist()}
    columns |= {f"throttle_{i + 1}": column.tolist() for i, column in enumerate(throttle.T)}
    residual = np.concatenate([each.residual for each in found])
    columns |= {f"residual_{axis}": column.tolist() for axis, column in zip(AXES, residual.T, strict=True)}
    return columns | {"status": good}


def trim_table(speeds: Sequence[float], found: Sequence[Trim]) -> Columns:
    """Trims for the eye."""
    attitude, throttle, good = _trims(found)
    theta, phi = np.degrees(attitude).T
    columns: Columns = {"V_lon m/s": speeds, "theta deg": theta.tolist(), "phi deg": phi.tolist()}
    columns |= {f"rotor {i + 1}": column.tolist() for i, column in enumerate(throttle.T)}
    return columns | {"status": good}


def _trims(found: Sequence[Trim]) -> tuple[Any, Any, list[str]]:
    status = np.concatenate([each.status for each in found])
    failed = (status != Status.OK)[:, None]
    attitude = np.where(failed, np.nan, np.concatenate([each.attitude for each in found]))
    throttle = np.where(failed, np.nan, np.concatenate([each.throttle for each in found]))
    return attitude, throttle, [Status(int(code)).text for code in status]


def history_table(history: TimeHistory, rows: int = 21) -> Columns:
    """Some instants of the first run, evenly spaced."""
    at = np.unique(np.linspace(0, history.time.size - 1, rows).round().astype(int))
    columns: Columns = {"t s": history.time[at].tolist()}
    for name in (history.input_name, "V_lon", "V_lat", "V_vert", "phi", "theta", "psi", "p", "q", "r"):
        values, unit = history.channels[name][0, at], history.units[name]
        columns[f"{name} {unit.replace('rad', 'deg')}"] = (np.degrees(values) if "rad" in unit else values).tolist()
    return columns


def criteria_table(history: TimeHistory, flown: Manoeuvre) -> Columns:
    """What the criterion of a step or a pulse measures on the first run; the run's own status where it failed or there is none."""
    run = Status(int(history.status[0]))
    axis = ROTATION.get(flown.axis)
    if run.failed or axis is None:
        return {"value": ["run"], "": [""], "unit": [""], "status": [run.text]}
    if flown.shape == "step":
        quick = attitude_quickness(history, axis)
        texts = Status(int(quick.status[0])).text, Status(int(quick.status_min[0])).text
        rows = [
            ("quickness", quick.quickness[0], "1/s", texts[0]),
            ("peak rate", np.degrees(quick.q_pk[0]), "deg/s", texts[0]),
            ("delta_theta_pk", np.degrees(quick.delta_theta_pk[0]), "deg", texts[0]),
            ("delta_theta_min", np.degrees(quick.delta_theta_min[0]), "deg", texts[1]),
        ]
        level = quick.level[0]
    else:
        free = dynamic_stability(history, axis)
        rows = [
            ("zeta", free.zeta[0], "1", Status(int(free.status[0])).text),
            ("omega_n", free.omega_n[0], "rad/s", Status(int(free.status_omega[0])).text),
        ]
        level = free.level[0]
    names, values, units, status = (list(column) for column in zip(*rows, strict=True))
    return {
        "value": [*names, "Level"],
        "": [*(f"{value:.4g}" for value in values), _level(int(level))],
        "unit": [*units, ""],
        "status": [*status, ""],
    }


def _level(code: int) -> str:
    return {Level.UNDEFINED: "undefined", Level.OUTSIDE: "outside the requirement's range"}.get(Level(code), str(code))


def pole_table(model: LinearModel, command: str, output: str) -> Columns:
    """Poles by natural frequency, one of each conjugate pair; the one that dominates ``output`` under ``command`` is marked."""
    _require(model, command, output)
    dominant = model.dominant(command, output)
    poles = model.poles()
    keep = np.flatnonzero(poles.s.imag >= -1e-9)
    keep = keep[np.argsort(poles.omega_n[keep])]
    s = poles.s[keep]
    return {
        "real 1/s": s.real.tolist(),
        "imag rad/s": s.imag.tolist(),
        "omega_n rad/s": poles.omega_n[keep].tolist(),
        "zeta": poles.zeta[keep].tolist(),
        "": [f"dominates {output}/{command}" if abs(each - dominant) < 1e-6 * abs(dominant) else "" for each in s],
    }


def response_record(model: LinearModel, command: str, output: str, omega: Sequence[float]) -> Columns:
    """Frequency response of ``output`` to ``command``."""
    _require(model, command, output)
    frequencies = np.asarray(omega, dtype=float)
    value = model.frequency_response(command, output, frequencies).value[0]
    with np.errstate(divide="ignore"):
        gain = 20.0 * np.log10(np.abs(value))
    return {
        "omega[rad/s]": frequencies.tolist(),
        "real": value.real.tolist(),
        "imag": value.imag.tolist(),
        "gain[dB]": gain.tolist(),
        "phase[deg]": np.degrees(np.unwrap(np.angle(value))).tolist(),
    }


def _require(model: LinearModel, command: str, output: str) -> None:
    for field, name, allowed in (("--input", command, COMMANDS), ("--output", output, SENSOR_CHANNELS)):
        if name not in allowed:
            raise unknown_name(field, name, allowed)
    status = Status(int(model.status[0]))
    if status.failed:
        raise InputError("--speed", status.text)
