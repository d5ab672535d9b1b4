"""The sections beyond the three criteria, added to a synthetic results folder by hand: nothing here is a reference."""

from __future__ import annotations

import copy
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import synthetic
import xarray as xr

from levelone.campaign.coupling import NO_PATH, PITCH
from levelone.report import amplitudes, cases, coupling, delay, froude, page, translation
from levelone.report.results import Results, load_results
from levelone.report.sections import SECTIONS as PAGE_SECTIONS
from levelone.status import Status

SECTIONS: dict[str, tuple[ModuleType, str]] = {
    "cases": (cases, "cases"),
    "coupling": (coupling, "coupling"),
    "amplitudes": (amplitudes, "amplitudes"),
    "froude": (froude, "froude"),
    "translation": (translation, "translational_rate"),
    "delay": (delay, "without_delay"),
}
TEXT = {"n": 500, "failed": 0, "min": 0.0, "max": 0.02, "p05": 0.001, "p50": 0.005, "p95": 0.012, "mean": 0.006, "std": 0.003}


def three_tables() -> dict[str, Any]:
    """Cases by hand: the second of each differs from the first in one coefficient; one sweep has no phase delay."""
    common = {"columns": ["C_L0", "C_mq"], "rows": [[0.45, -6.9], [0.63, -6.9], [0.63, -16.2]], "source": "Table 9"}
    ok = ["ok"] * 3
    return {
        "attitude_quickness": {
            **common, "name": "first", "level": [0, 0, 0], "status": {"quickness": ok, "delta_theta_min": ok},
            "values": {"quickness": [3.0, 3.06, 2.94], "delta_theta_min": [0.070, 0.071, 0.072]},
        },
        "dynamic_stability": {
            **common, "name": "second", "level": [2, 1, -1], "status": {"zeta": [*ok[:2], "no valley"], "omega_n": ok},
            "values": {"zeta": [0.30, 0.36, math.nan], "omega_n": [5.9, 5.8, 5.6]},
        },
        "bandwidth": {
            **common, "name": "third", "level": [1, 1, 1], "amplitude": 0.5, "omega_max": [15.0, 15.0, 15.0],
            "values": {"omega_bw": [4.5, 4.6, 4.2], "tau_p": [0.090, 0.091, 0.084], "omega_bw_attitude": [8.0, 8.1, 8.4],
                       "tau_p_attitude": [0.002, 0.002, 0.002], "omega_bw_swept": [4.49, 4.58, 4.21],
                       "tau_p_swept": [0.0901, math.nan, 0.0842]},
            "status": {**dict.fromkeys(("omega_bw", "tau_p", "omega_bw_attitude", "tau_p_attitude", "omega_bw_swept"), ok),
                       "tau_p_swept": ["ok", Status.RANGE_TOO_SHORT.text, "ok"]},
        },
    }  # fmt: skip


def sweeps() -> list[dict[str, Any]]:
    """Two amplitudes that agree and one that does not."""
    return [
        {"amplitude": a, "max_gain_difference_db": g, "max_phase_difference_deg": p, "within": w, "coherence_min": 0.9,
         "theta_pk_deg": 8.0 * a, "omega_bw": 4.4, "tau_p": math.nan if a == 1.0 else 0.09, "status": "ok",
         "tau_p_status": Status.LOW_COHERENCE.text if a == 1.0 else "ok"}
        for a, g, p, w in ((0.1, 0.2, 2.6, 1.0), (0.5, 0.4, 3.8, 1.0), (1.0, 2.7, 5.5, 0.97))
    ]  # fmt: skip


def screening() -> dict[str, Any]:
    """Two pitch factors, of which one hardly counts, and two roll factors that do nothing."""
    effects = {"I_y": 1.0, "C_Dq": 0.004, "C_lp": 0.0, "C_Ybeta": 1e-16}
    return {
        "added": ["C_lp", "C_Ybeta"], "n": 50, "trajectories": 10, "failed": dict.fromkeys((*PITCH, "ratio"), 0),
        "mu_star": {name: dict(effects) for name in PITCH} | {"ratio": dict.fromkeys(effects, 0.0)},
        "dropped": ["C_Dq", "C_lp", "C_Ybeta"], "undecided": [], "note": NO_PATH,
        "ratio": {**TEXT, "mean": 0.0, "max": 0.0}, "ratio_status": {"ok": 50},
        "ratio_literal": {**TEXT, "n": 50, "failed": 50, "mean": math.nan, "max": math.nan},
        "ratio_literal_status": {Status.ON_AXIS_RETURNED.text: 50},
        "level_shares": {"n": 50, "level_1": 1.0, "level_2": 0.0, "level_3": 0.0, "outside": 0.0, "failed": 0.0,
                         "level_1_ci": [0.9289, 1.0]},
    }  # fmt: skip


def share(level_1: float, **more: Any) -> dict[str, Any]:
    rest = {"level_3": 0.0, "outside": 0.0, "failed": 0.0, "level_1_ci": [level_1 - 0.02, level_1 + 0.02]}
    return {"n": 500, "level_1": level_1, "level_2": 1.0 - level_1, **rest, **more}


def extend(results: Results, folder: Path) -> Results:
    """A copy of a synthetic study in ``folder`` with every section added, and two responses of the ground speed."""
    for item in results.directory.iterdir():
        if item.is_file():
            shutil.copy(item, folder)
    linear = results.linear
    omega = np.linspace(0.3, 15.0, 200)
    exact = np.interp(omega, linear["omega"], linear["q_re"]) + 1j * np.interp(omega, linear["omega"], linear["q_im"])
    value = np.array([1.01, 1.02, 1.3])[:, None] * exact
    data = {"q_re": value.real, "q_im": value.imag, "coherence": np.full(value.shape, 0.9)}
    xr.Dataset({k: (("amplitude", "omega"), v) for k, v in data.items()}, {"amplitude": [0.1, 0.5, 1.0], "omega": omega}).to_netcdf(
        folder / "frequency.nc", mode="a", group="amplitudes", engine="h5netcdf"
    )

    def add(summary: dict[str, Any]) -> None:
        summary |= {"cases": three_tables(), "amplitudes": sweeps(), "coupling": screening()}
        held = {"unit": "s", "failures": {}, "cautions": {}, **TEXT, "mean": 0.09, "std": 0.0018}
        summary["without_delay"] = {"n": 500, "tau_d": 0.0, "responses": {"tau_p": held}}
        summary["levels"]["translational_rate"] = share(0.02)
        scaled = {name: share(0.4) for name in ("dynamic_stability", "bandwidth", "worst", "translational_rate")}
        scaled["attitude_quickness"] = share(0.0, extrapolated={"level_1": 0.0, "level_2": 1.0, "level_3": 0.0})
        stated = {"length": 4.0, "reference_length": 16.0, "scale": 2.0, "basis": "by hand", "confidence": {"bandwidth": "medium"}}
        summary["levels_froude"] = scaled | stated
        for name, unit, centre, like in (("rise_time", "s", 0.9, "zeta"), ("overshoot", "1", 0.2, "omega_n")):
            entry = copy.deepcopy(summary["responses"][like])
            summary["responses"][name] = entry | {"unit": unit, "criterion": "translational_rate", "nominal": centre}

    whole = load_results(synthetic.rewrite(folder, add))
    spread = results.monte_carlo.sel(response=["zeta", "omega_n"])
    moved = spread.assign_coords(response=["rise_time", "overshoot"])
    moved["values"] = moved["values"] / moved["values"].mean("run") * xr.DataArray([0.9, 0.2], dims="response")
    return replace(whole, monte_carlo=xr.concat([results.monte_carlo, moved], "response", data_vars="minimal"))


def alter(results: Results, change: Callable[[dict[str, Any]], None]) -> Results:
    summary = copy.deepcopy(dict(results.summary))
    change(summary)
    return replace(results, summary=summary)


class Walk(HTMLParser):
    """Text of a page, and whether its tags close in order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.tables: list[list[int]] = []
        self.spanned = 0
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "br":
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append(self.spanned)
            self.spanned = 0
        if tag in ("td", "th"):
            self.tables[-1][-1] += 1
            self.spanned += ("rowspan", "2") in attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def section(results: Results, name: str) -> Walk:
    """One section as the page has it, without pictures."""
    module, key, _ = PAGE_SECTIONS[name]
    environment = page.environment()
    made = environment.from_string('{% from "macros.html" import table %}' + f'{{% include "{name}.html" %}}')
    walk = Walk(made.render({name: module.context(results), "drawings": {key: []}}))
    assert walk.open == []
    return walk
