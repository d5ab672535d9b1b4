"""The nonlinear frequency sweep of one vehicle, beside the linearisation that the study uses in its place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from levelone.campaign.models.builtin import BuiltinModel
from levelone.dynamics import LinearModel, linearize, simulate
from levelone.handling.bandwidth import Bandwidth, bandwidth
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.identification import identify
from levelone.handling.manoeuvres import Manoeuvre
from levelone.status import Status
from levelone.vehicle import VehicleBatch, batch_of

#: where linear and swept responses are compared, rad/s, and what counts as agreement
COMPARED, GAIN_DB, PHASE_DEG = (0.5, 12.0), 2.0, 5.0
#: highest frequency that a sweep is extended to, as a part of the controller's Nyquist frequency
BELOW_NYQUIST = 0.9


@dataclass(frozen=True)
class SweepCheck:
    """Linear and swept responses of one vehicle for both readings, and what the sweep's reading of bandwidth is."""

    manoeuvre: Manoeuvre
    history: TimeHistory
    linear: dict[str, FrequencyResponse]
    swept: dict[str, FrequencyResponse]
    linear_reading: dict[str, Bandwidth]
    swept_reading: Bandwidth
    model: LinearModel
    windows: tuple[float, ...]

    def differences(self, output: str = "q") -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """omega (rad/s), gain difference (dB), phase difference (deg) and coherence over the compared range."""
        swept = self.swept[output]
        inside = (swept.omega >= COMPARED[0]) & (swept.omega <= COMPARED[1])
        omega = swept.omega[inside]
        exact = self.model.frequency_response("V_lon", output, omega).value[0] * (1.0 if output == "q" else -1.0)
        with np.errstate(invalid="ignore"):  # of a vehicle that cannot fly: NaN stays NaN
            ratio = np.atleast_2d(swept.value)[0, inside] / exact
        coherence = np.atleast_2d(swept.coherence)[0, inside]
        return omega, 20.0 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio)), coherence

    def summary(self) -> dict[str, Any]:
        """The comparison in numbers (q / V_lon)."""
        _, gain, phase, coherence = self.differences()
        within = np.where(np.isnan(gain), np.nan, (np.abs(gain) <= GAIN_DB) & (np.abs(phase) <= PHASE_DEG))
        reading = self.swept_reading
        return {
            "amplitude": self.manoeuvre.amplitude, "omega_max": self.manoeuvre.omega_max, "windows_s": list(self.windows),
            "max_gain_difference_db": float(np.abs(gain).max()), "max_phase_difference_deg": float(np.abs(phase).max()),
            "within": float(within.mean()), "coherence_min": float(coherence.min()),
            "omega_bw": float(np.ravel(reading.omega_bw)[0]), "tau_p": float(np.ravel(reading.tau_p)[0]),
            "status": Status(int(np.ravel(reading.status_phase)[0])).text,
            "tau_p_status": Status(int(np.ravel(reading.status_tau_p)[0])).text,
        }  # fmt: skip


def sweep_check(model: BuiltinModel, sweep: Manoeuvre, windows: tuple[float, ...], batch: VehicleBatch | None = None) -> SweepCheck:
    """Fly the sweep, extended to 2.5 omega_180 where the linear response says that phase delay needs it, and identify it.

    Of the nominal vehicle, or of the one airframe in ``batch``.
    """
    flown = batch_of(model.vehicle) if batch is None else batch
    step = model.step
    linear_model = linearize(flown, step.trim_speed, flight_mode=step.flight_mode, dt=step.dt, threads=model.threads)
    linear = {name: linear_model.frequency_response("V_lon", name, model.omega).select(0) for name in ("q", "theta")}
    linear["theta"] = -linear["theta"]
    reading = {name: bandwidth(r, "attitude_command", task=model.task, boundaries=model.boundaries) for name, r in linear.items()}
    needed = min(2.5 * float(reading["q"].omega_180), BELOW_NYQUIST * np.pi * sweep.controller_rate)
    if np.isfinite(needed) and needed > sweep.omega_max:
        sweep = replace(sweep, omega_max=needed)
    history = simulate(flown, sweep, channels=("q", "theta", "V_lon"), threads=model.threads)
    swept = {
        name: identify(history, name, sign=sign, windows=windows, omega_min=sweep.omega_min, omega_max=sweep.omega_max).select(0)
        for name, sign in (("q", 1), ("theta", -1))
    }
    swept_reading = bandwidth(swept["q"], "attitude_command", task=model.task, boundaries=model.boundaries)
    return SweepCheck(sweep, history, linear, swept, reading, swept_reading, linear_model, windows)
