"""Conversion of a trim and gain table to state-space files, on a made-up table of the same shape."""

from __future__ import annotations

import functools
import importlib
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from levelone.config.state_space_file import load_state_space

ROOT = Path(__file__).parents[3]


@functools.cache
def tool() -> ModuleType:
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        return importlib.import_module("guam_state_space")
    finally:
        sys.path.remove(str(ROOT / "tools"))


def made_up() -> dict[str, Any]:
    """An aircraft with eight lift rotors fore and aft, a pusher, elevator and flap; gains by the linear-quadratic regulator."""
    A = np.array([[-0.05, 0.01, 0.1, -32.2], [-0.04, -0.12, 0.5, -0.3], [0.003, -0.001, -0.1, 0.0], [0.0, 0.0, 1.0, 0.0]])
    B = np.zeros((4, 11))
    B[1, :8], B[2, :4], B[2, 4:8] = -0.08, 0.0034, -0.0031
    B[:3, 8], B[:3, 9], B[:3, 10] = (0.04, 0.0, 0.0), (0.1, -0.05, -0.02), (0.02, -0.1, 0.0)
    whole = np.zeros((6, 6))
    whole[:3, 3:], whole[3:, 3:] = np.eye(3), A[:3, :3]
    entry = np.vstack([np.zeros((3, 3)), np.eye(3)])
    gains = entry.T @ solve_continuous_are(whole, entry, np.diag([0.01, 0.01, 1000.0, 0.0, 0.0, 0.0]), np.eye(3))
    weights = [1.0] * 9 + [1e3, 1e7, 0.1]
    return {
        "u_ft_s": 8.4,
        "A": A,
        "B": B,
        "W_diag": np.array(weights),
        "Kx": np.hstack([gains[:, 3:], np.zeros((3, 1))]),
        "Ki": gains[:, :3],
    }


@pytest.mark.theory
def test_the_loop_is_that_of_the_design_function(tmp_path: Path) -> None:
    """Its closed matrix by blocks: integrals first, then u, w, q and theta."""
    point = made_up()
    A, B, Kx, Ki = (point[name] for name in ("A", "B", "Kx", "Ki"))
    effect = np.hstack([B[:3], A[:3, 3:]])
    spared = np.diag(1.0 / point["W_diag"])
    share = spared @ effect.T @ np.linalg.inv(effect @ spared @ effect.T)
    third, theta = np.array([[0.0], [0.0], [1.0]]), np.array([[0.0, 0.0, 0.0, 1.0]])
    inner = third @ share[11:]
    expected = np.block([[inner @ Ki, inner @ Kx + third @ theta + np.eye(4)[:3]], [-B @ share[:11] @ Ki, A - B @ share[:11] @ Kx]])
    path = tmp_path / "point.toml"
    path.write_text(tool().state_space(point, actuators=False))
    system = load_state_space(path).system({})
    order = [4, 5, 6, 0, 1, 2, 3]
    # e_q' = q + theta - theta_c, and the law is m = -Kx x - Ki e: the same matrix
    np.testing.assert_allclose(system.A[np.ix_(order, order)], expected, atol=1e-9)
    assert system.poles().real.max() < -0.1


@pytest.mark.theory
def test_the_loop_follows_its_command_by_pitching(tmp_path: Path) -> None:
    path = tmp_path / "point.toml"
    path.write_text(tool().state_space(made_up()))
    file = load_state_space(path)
    system, command = file.system({}), file.inputs.index("u_ref")
    assert len(system.A) == 4 + 2 * 11 + 3
    speed, theta = (system.frequency_response(command, file.outputs.index(name), np.array([1e-4, 1.0])) for name in ("u", "theta"))
    assert speed[0] == pytest.approx(1.0, abs=1e-3)
    assert 1j * speed[1] / theta[1] == pytest.approx(-32.2, rel=0.1)  # the aircraft is pulled by its tilted thrust


def test_every_point_of_a_table_becomes_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    points = [{**made_up(), "u_ft_s": speed} for speed in (0.0, 16.88)]
    plain = [
        {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in point.items()} for point in points
    ]
    table = tmp_path / "table.json"
    table.write_text(json.dumps({"points": plain}))
    monkeypatch.setattr(sys, "argv", ["guam_state_space.py", str(table), "--out", str(tmp_path / "out")])
    tool().main()
    assert capsys.readouterr().out.split() == [str(tmp_path / "out" / name) for name in ("u00.00.toml", "u16.88.toml")]
    assert load_state_space(tmp_path / "out" / "u16.88.toml").inputs[-2:] == ("u_ref", "w_ref")


@pytest.mark.parametrize(
    ("name", "value", "message"), [("B", np.zeros((4, 9)), r"points\[0\].B has shape"), ("Kx", np.ones((3, 4)), "last column")]
)
def test_a_table_of_another_kind_is_refused(name: str, value: np.ndarray, message: str, tmp_path: Path) -> None:
    point = {key: each.tolist() if isinstance(each, np.ndarray) else each for key, each in (made_up() | {name: value}).items()}
    table = tmp_path / "table.json"
    table.write_text(json.dumps({"points": [point]}))
    with pytest.raises(SystemExit, match=message):
        tool().read_points(table)
