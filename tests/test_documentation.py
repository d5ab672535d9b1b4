"""The examples of README and tutorial run as they stand."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def examples(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), flags=re.S)


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md"])
def test_examples_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from levelone import load_vehicle, pulse, simulate

    monkeypatch.chdir(tmp_path)
    simulate(load_vehicle("reference-evtol"), pulse("V_lon", 0.7, trim_speed=5.0)).to_csv("pulse.csv")
    found = examples(page)
    assert found
    for code in found:
        exec(compile(code, page, "exec"), {})
    assert "nan" not in capsys.readouterr().out


@pytest.mark.parametrize("page", sorted(str(p.relative_to(ROOT)) for p in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]))
def test_links_lead_somewhere(page: str) -> None:
    text = (ROOT / page).read_text()
    for target in re.findall(r"\]\(([^)#]+)", text):
        assert target.startswith("http") or ((ROOT / page).parent / target).exists(), target
