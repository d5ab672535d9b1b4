"""The page of a calibration: complete, escaped, the same whenever it is written, and plain about what is undefined or not met."""

from __future__ import annotations

import copy
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from levelone.errors import InputError
from levelone.report import calibration_figures as figures
from levelone.report import style
from levelone.report.calibration import render_calibration

HOSTILE = "<script>alert('x')</script> & $\\frac{1}{ {{ 7 * 7 }}"
PATHS = {"controller.pitch_rate.Kp": 5.5, "controller.command_lag": 0.0, "rotors.position.x": 1.0}
REACHED = {"omega_n": 5.64, "zeta": 0.361, "delta_theta_pk": 0.11}


def target(response: str, unit: str, value: float, tolerance: float, accept: list[float]) -> dict[str, Any]:
    return {"response": response, "unit": unit, "value": value, "tolerance": tolerance, "accept": accept, "origin": "a study"}


def run(shift: float, **other: Any) -> dict[str, Any]:
    values = {path: prior + shift * 0.01 for path, prior in PATHS.items()}
    return {
        "start": {path: prior + shift * 0.1 for path, prior in PATHS.items()}, "values": values, "changes": values,
        "target_cost": 2.5 + shift, "prior_cost": 0.02, "evaluations": 4, "undefined": 0, "outcome": "converged",
        "reached": {name: value * (1.0 + 0.001 * shift) for name, value in REACHED.items()},
        "status": dict.fromkeys(REACHED, "ok"), "accepted": True, "missed": [],
    } | other  # fmt: skip


def parameter(path: str, prior: float, **other: Any) -> dict[str, Any]:
    return {
        "path": path, "ties": [], "unit": "1/s", "prior": prior, "low": 0.1, "high": 20.0, "spread": 1.5, "scale": "log",
        "role": "fit", "assumed": "a guess",
    } | other  # fmt: skip


def synthetic() -> dict[str, Any]:
    names = list(REACHED)
    slopes = {path: dict.fromkeys(names, 0.1 * (i + 1)) for i, path in enumerate(PATHS)}
    known = {"removed": 0.92, "spread_ratio": 0.13, "spread_status": "ok", "identified": True, "verdict": "identified"}
    unknown = {"removed": 0.01, "spread_ratio": math.nan, "spread_status": "held", "identified": False,
               "verdict": "not identified: the targets remove 1 % of its prior variance"}  # fmt: skip
    return {
        "schema": 1,
        "calibration": {
            "name": "test", "title": "A calibration", "file": "calibration.toml", "study": "reference", "seed": 7, "starts": 2,
            "perturbation": 1.4, "digits": 4,
            "targets": [target("omega_n", "rad/s", 5.61, 0.1, [5.33, 5.89]), target("zeta", "1", 0.37, 0.015, [0.33, 0.42]),
                        target("delta_theta_pk", "rad", 0.1, 0.01, [0.05, 0.2])],
            "parameters": [parameter("controller.pitch_rate.Kp", 5.5, ties=["controller.roll_rate.Kp"]),
                           parameter("controller.command_lag", 0.0, scale="linear", spread=0.05, unit="s"),
                           parameter("rotors.position.x", 1.0, role="draw")],
        },
        "vehicle": {"name": "craft", "file": "craft.toml"},
        "starts": [{"name": "priors"} | run(0.0), {"name": "start 1"} | run(1.0), {"name": "start 2"} | run(2.0)],
        "calibrations": [],
        "identifiability": {
            "limits": {"removed": 0.5, "correlation": 0.8, "spread": 0.5}, "sensitivity": slopes, "jacobian": slopes,
            "singular_values": [21.9, 3.1], "directions": [dict.fromkeys(PATHS, 0.577), dict.fromkeys(PATHS, 0.05)],
            "parameters": dict(zip(PATHS, (known, unknown, unknown), strict=True)),
            "not_apart": [{"a": "controller.pitch_rate.Kp", "b": "controller.command_lag", "correlation": -0.93}],
        },
        "tradeoff": {
            "response": "delta_theta_pk", "tolerance": 0.001,
            "families": {"other": {"controller.pitch_rate.Kp": {"prior": 14.0, "high": 30.0}}},
            "curves": {"priors of the file": [{"asked": a} | run(a) for a in (0.08, 0.1, 0.12)],
                       "other": [{"asked": a} | run(-a) for a in (0.08, 0.1, 0.12)]},
        },
        "checks": {
            "stability": [{"speed": 0.0, "largest_pole": 0.999, "stable": True, "status": "ok"}],
            "inactive": [{"path": "controller.rate_limit", "raised_to": 4.5, "largest_change": 0.0}],
            "limits": [{"response": "delta_theta_pk", "unit": "rad", "high": 0.2, "origin": "a study", "largest": 0.15, "n": 500,
                        "above": 0, "failures": {}, "cautions": {}}],
        },
        "method": {"closeness": 1e-5},
        "provenance": {"levelone": "0", "finished": "2024-05-01", "wall_s": 1.0},
    }  # fmt: skip


def rendered(folder: Path, content: dict[str, Any]) -> str:
    (folder / "calibration.json").write_text(json.dumps(content))
    path = render_calibration(folder)
    assert path == folder / "calibration.html"
    return path.read_text(encoding="utf-8")


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<style>.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL))


def test_the_page_says_what_was_found(tmp_path):
    page = rendered(tmp_path, synthetic())
    text = text_of(page)
    for words in (
        "All targets are met",
        "Not identified: controller.command_lag , rotors.position.x",
        "Cannot be told apart",
        "controller.pitch_rate.Kp and controller.command_lag (−0.93)",
        "2 of 2 fits from perturbed starts meet all targets",
        "= controller.roll_rate.Kp",
        "not fitted, drawn for each start",
        "with the prior 14 and up to 30",
        "6.303",  # delta_theta_pk reached, in deg
        "4.584",  # and asked for on the first point of the trade-off
    ):
        assert words in text, words
    assert "nan" not in text.lower().split()
    assert len(re.findall(r"<figure id=", page)) == 4
    for name in ("sensitivities", "starts", "parameters", "tradeoff"):
        assert (tmp_path / "figures" / f"calibration_{name}.png").stat().st_size > 5000
        assert f'id="calibration_{name}"' in page


def test_the_same_results_give_the_same_bytes(tmp_path):
    pages = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        pages.append(rendered(tmp_path / name, synthetic()))
    assert pages[0] == pages[1]
    drawings = sorted(path.name for path in (tmp_path / "a" / "figures").iterdir())
    assert len(drawings) == 8
    for name in drawings:
        assert (tmp_path / "a" / "figures" / name).read_bytes() == (tmp_path / "b" / "figures" / name).read_bytes()


def test_what_is_missed_or_undefined_is_said(tmp_path):
    content = synthetic()
    content["starts"][0] |= {"accepted": False, "missed": ["zeta is 0.3, accepted from 0.33 to 0.42 1"]}
    content["starts"][1] |= {
        "accepted": False,
        "missed": ["omega_n: the phase never reaches it"],
        "reached": REACHED | {"omega_n": math.nan},
        "outcome": "a target is undefined where the fit ended: move the priors",
    }
    text = text_of(rendered(tmp_path, content))
    assert "Not met: zeta is 0.3, accepted from 0.33 to 0.42" in text
    assert "omega_n: the phase never reaches it" in text
    assert "undefined" in text
    assert "1 of 2 fits" in text
    row = text[text.index("Damping ratio") :]
    assert row.index(" no ") < row.index("a study")


def test_a_calibration_without_starts_and_trade_off_has_no_such_sections(tmp_path):
    content = synthetic()
    content["starts"], content["tradeoff"] = content["starts"][:1], {}
    page = rendered(tmp_path, content)
    assert 'id="starts"' not in page
    assert 'id="tradeoff"' not in page
    assert len(re.findall(r"<figure id=", page)) == 1


def test_what_a_file_says_is_shown_as_text(tmp_path):
    content = copy.deepcopy(synthetic())
    content["calibration"]["title"] = HOSTILE
    content["calibration"]["parameters"][0]["assumed"] = HOSTILE
    content["calibration"]["targets"][0]["origin"] = HOSTILE
    content["tradeoff"]["curves"] = {HOSTILE: content["tradeoff"]["curves"]["other"]}
    page = rendered(tmp_path, content)
    assert "<script>" not in page
    assert page.count("&lt;script&gt;") >= 4
    assert "49" not in page[page.index("<h1>") : page.index("</h1>")]


@pytest.mark.parametrize(
    ("text", "problem"),
    [("[1, 2]", "schema 1"), ("{", "is not a JSON file"), ('{"schema": 1}', "misses"), ('{"schema": 2}', "schema 1")],
)
def test_what_is_no_calibration_is_refused(tmp_path, text, problem):
    (tmp_path / "calibration.json").write_text(text)
    with pytest.raises(InputError, match=problem):
        render_calibration(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["calibration.json"]


def test_a_folder_without_a_calibration_is_refused(tmp_path):
    with pytest.raises(InputError, match="no calibration here"):
        render_calibration(tmp_path)


@pytest.mark.parametrize(
    ("path", "label"),
    [
        ("controller.pitch_rate.Kp", "pitch rate $K_p$"),
        ("controller.command_lag", "command lag"),
        ("rotors.position.x", "rotor position x"),
        ("controller.pitch_rate.tau_f", r"pitch rate $\tau_f$"),
        ("pushers.max_thrust", "pushers max thrust"),
    ],
)
def test_labels(path, label):
    assert figures.label(path) == label


def test_sensitivities_print_every_number_and_mark_what_is_not_logarithmic():
    with style.paper():
        figure = figures.draw_sensitivities(synthetic())
    panel = figure.axes[0]
    assert [item.get_text() for item in panel.texts] == ["0.10"] * 3 + ["0.20"] * 3 + ["0.30"] * 3
    assert [item.get_text() for item in panel.get_yticklabels()] == [
        "pitch rate $K_p$",
        "command lag, per 0.05 s",
        "rotor position x",
    ]
    assert [bar.get_width() for bar in figure.axes[1].patches] == [0.92, 0.01, 0.01]


def test_trade_off_draws_each_curve_in_the_units_of_the_field():
    with style.paper():
        figure = figures.draw_tradeoff(synthetic())
    curve = figure.axes[0].get_lines()[0]
    points = synthetic()["tradeoff"]["curves"]["priors of the file"]
    assert curve.get_xdata() == pytest.approx([math.degrees(point["reached"]["delta_theta_pk"]) for point in points])
    assert curve.get_ydata() == pytest.approx([point["reached"]["omega_n"] for point in points])
    assert [axes.get_xlabel() for axes in figure.axes] == [r"$\Delta\theta_{\mathrm{pk}}$, deg"] * 2
