"""docs/reference/results.md names what a results folder holds, and its example runs."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "results.md").read_text(encoding="utf-8")


def test_every_key_is_named(folder: Path) -> None:
    summary = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    response = summary["responses"]["zeta"]
    keys = {*summary, *summary["responses"], *response, *response["monte_carlo"], *summary["levels"]["attitude_quickness"]}
    for block in ("morris", "sobol"):
        keys |= set(response[block]["M"])
    missing = {key for key in keys - {"morris_unit", "n", "provenance"} if f"`{key}`" not in PAGE}
    assert missing == set()


@pytest.mark.parametrize("name", ["histories.nc", "frequency.nc", "monte_carlo.nc", "results.json", "report.html"])
def test_every_file_is_named(name: str) -> None:
    assert f"`{name}`" in PAGE


@pytest.mark.usefixtures("page")
def test_every_kind_of_figure_is_named(folder: Path) -> None:
    kinds = {re.split(r"_|\.", item.name)[0] for item in (folder / "figures").iterdir()}
    assert kinds == {"history", "plane", "screening", "sobol", "bode"}
    table = PAGE[PAGE.index("## Figures") :]
    assert all(f"`{kind}" in table for kind in kinds)


def test_example_runs(folder: Path, tmp_path: Path) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    script = tmp_path / "example.py"
    script.write_text(code.replace("results/mine", str(folder)), encoding="utf-8")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert 0.3 < float(done.stdout) < 0.4
