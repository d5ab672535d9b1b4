"""The reference study through Dakota and through levelone, in one run on one machine: indices, wall and CPU time.

``pytest benchmarks/test_dakota.py -s``; some minutes, most of them Dakota's.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from dakota_route import surfpack_vbd
from levelone.campaign.dakota.compare import compare_routes
from levelone.campaign.dakota.execute import find_dakota
from levelone.config.study_file import load_study
from levelone.errors import InputError
from levelone.uncertainty import Factor, FactorSpace, Uniform, latin_hypercube

ROOT = Path(__file__).parents[1]
REFERENCE = tomllib.loads((ROOT / "tests" / "reference" / "uncertainty.toml").read_text(encoding="utf-8"))
SIX = ("quickness", "delta_theta_min", "zeta", "omega_n", "omega_bw", "tau_p")

try:
    find_dakota()
except InputError as missing:
    pytest.skip(str(missing), allow_module_level=True)


def test_the_study_by_both_routes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = compare_routes(load_study(ROOT / "studies" / "reference" / "study.toml"), tmp_path, responses=SIX)
    with capsys.disabled():
        print(f"\n{'stage':15s}{'wall s':>9s}{'CPU s':>9s}{'Dakota wall s':>15s}{'Dakota CPU s':>14s}")
        for row in found["stages"]:
            print(f"{row['stage']:15s}{row['wall']:9.1f}{row['cpu']:9.1f}{row['wall_dakota']:15.1f}{row['cpu_dakota']:14.1f}")
        print(f"{'response':17s}{'Q2':>7s}{'ranks mu_star':>15s}{'ranks ST':>10s}{'largest S1, ST difference':>28s}")
        for name, row in found["responses"].items():
            apart, ranks = row["largest_difference"], row["rank_agreement"]
            print(f"{name:17s}{row['q2']:7.4f}{ranks['mu_star']:15.3f}{ranks['ST']:10.3f}{apart['S1']:18.4f}{apart['ST']:10.4f}")
    assert all(np.isfinite(row["rank_agreement"]["ST"]) for row in found["responses"].values())


@pytest.mark.parametrize("name", ["ishigami", "sobol_g"])
def test_surfpack_on_500_runs_of_14_inputs(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    u = latin_hypercube(FactorSpace([Factor(f"x{j}", Uniform(0.0, 1.0)) for j in range(14)]), 500, 0).unit_points
    given = REFERENCE[name]
    if name == "ishigami":
        x = np.pi * (2.0 * u - 1.0)
        y = np.sin(x[:, 0]) + given["a"] * np.sin(x[:, 1]) ** 2 + given["b"] * x[:, 2] ** 4 * np.sin(x[:, 0])
    else:
        y = np.prod((np.abs(4.0 * u - 2.0) + np.array(given["a"])) / (1.0 + np.array(given["a"])), axis=1)
    found = surfpack_vbd(u, y)
    listed = given["ST"]
    exact = np.array(listed + [0.0 if name == "ishigami" else listed[-1]] * (14 - len(listed)))
    with capsys.disabled():
        print(f"\nsurfpack {name:9s}: {found['cpu']:.1f} CPU s, largest ST error {np.abs(found['ST'] - exact).max():.4f}")
    assert np.isfinite(found["ST"]).all()
