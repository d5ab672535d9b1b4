"""The records that the report draws: nominal histories with what was picked on them, some Monte Carlo runs, and the responses."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.store import history_dataset
from levelone.campaign.sweep import SweepCheck
from levelone.handling.damping import DynamicStability
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.quickness import Quickness
from levelone.uncertainty import Design

DRAWN = ("q", "theta", "V_lon", "V_lon_ref")
#: Monte Carlo runs kept behind the nominal one
BEHIND = 30


def history_groups(model: BuiltinModel, sample: Design, swept: SweepCheck) -> dict[str, xr.Dataset]:
    """One group a manoeuvre: run 0 is nominal, the first Monte Carlo samples follow (none for the sweep)."""
    nominal = np.array([[_nominal(model, target) for target in model.targets]])
    batch = model.batch(np.vstack([nominal, sample.points[:BEHIND]]))
    quick, damped = model.reference
    groups = {}
    for name, manoeuvre, attrs in (
        ("attitude_quickness", model.step, _quickness_picks(quick)),
        ("dynamic_stability", model.pulse, _stability_picks(damped)),
    ):
        groups[name] = history_dataset(model.fly(batch, manoeuvre, ("q", "theta", "V_lon")), DRAWN, attrs)
    groups["bandwidth"] = history_dataset(swept.history, DRAWN, {"amplitude": swept.manoeuvre.amplitude})
    return groups


def _nominal(model: BuiltinModel, target: str) -> float:
    from levelone.vehicle import nominal_value

    return nominal_value(model.vehicle, target, model.step.trim_speed)


def _quickness_picks(quick: Quickness) -> dict[str, float]:
    p = quick.picks
    return {
        "t_q_pk": float(p.time[0, 0]), "q_pk": float(p.value[0, 0]), "t_theta_pk": float(p.time[0, 1]),
        "theta_pk": float(p.value[0, 1]), "t_second": float(p.time[0, 2]), "theta_second": float(p.value[0, 2]),
    }  # fmt: skip


def _stability_picks(damped: DynamicStability) -> dict[str, float]:
    p = damped.picks
    out = {"t_free": float(p.start[0])}
    for i in range(3):
        out |= {f"t_{i + 1}": float(p.time[0, i]), f"q_{i + 1}": float(p.value[0, i])}
    return out


def frequency_groups(swept: SweepCheck) -> dict[str, xr.Dataset]:
    """Linear and swept responses of the nominal vehicle in both readings."""
    readings = {
        f"{key}{suffix}": float(getattr(swept.linear_reading[name], key))
        for name, suffix in (("q", ""), ("theta", "_attitude"))
        for key in ("omega_bw", "omega_180", "tau_p")
    }
    linear = _responses(swept.linear).assign_attrs(readings)
    window = {"window_s": max(swept.windows), "amplitude": swept.manoeuvre.amplitude}
    return {"linear": linear, "swept": _responses(swept.swept).assign_attrs(window)}


def _responses(found: dict[str, FrequencyResponse]) -> xr.Dataset:
    data: dict[str, Any] = {}
    for name, response in found.items():
        value = np.ravel(response.value)
        data[f"{name}_re"], data[f"{name}_im"] = ("omega", value.real), ("omega", value.imag)
        if response.coherence is not None:
            data["coherence" if name == "q" else f"{name}_coherence"] = ("omega", np.ravel(response.coherence))
    return xr.Dataset(data, coords={"omega": next(iter(found.values())).omega})
