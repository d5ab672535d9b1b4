"""State-space files: what they hold, what is refused, and the loops they close."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "campaign" / "models"))
from linear_fixtures import REFERENCE_FILE, reference_system, write_reference

from levelone.config.state_space_file import load_state_space
from levelone.dynamics.feedback import allocation
from levelone.errors import InputError

PITCH = """\
[system]
name = "pitch of a rigid body with attitude hold"

[parameters]
M_d = 2.0
late = 0.0

[states]
names = ["theta", "q"]
units = ["rad", "rad/s"]

[inputs]
names = ["delta", "gust"]
units = ["rad", "m/s"]
delay = ["late", 0.0]

[matrices]
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0, 0.0], ["M_d", 0.1]]
"""
LAW = """\
[feedback]
controls = ["delta"]
states = ["theta", "q"]
Kx = [[3.0, 1.5]]
sign_x = -1
Ki = [[0.8]]
sign_i = -1
[feedback.commands]
names = ["theta_ref"]
units = ["rad"]
[[feedback.integral]]
of = { theta = 1.0 }
command = "theta_ref"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_gives_its_matrices_and_names(tmp_path: Path) -> None:
    A, B, C, D, names = reference_system()
    file = load_state_space(write_reference(tmp_path / "reference.toml"))
    system = file.system({})
    for found, expected in ((system.A, A), (system.B, B), (system.C, C), (system.D, D)):
        np.testing.assert_array_equal(found, expected)
    assert (file.states, file.inputs, file.outputs) == names
    assert file.output_units == ("rad", "rad/s", "m/s")


def test_a_parameter_changes_the_entries_that_name_it(tmp_path: Path) -> None:
    file = load_state_space(write_reference(tmp_path / "reference.toml"))
    np.testing.assert_array_equal(file.system({"A_mq": -136.0 * 1.2}).A, reference_system(1.2)[0])
    np.testing.assert_array_equal(file.system({}).A, reference_system()[0])  # and the file's own values are as they were


def test_a_minus_before_a_parameter(tmp_path: Path) -> None:
    text = REFERENCE_FILE.replace('"A_mq"', '"-A_mq"').replace("A_mq = -136.0", "A_mq = 136.0")
    np.testing.assert_array_equal(load_state_space(written(tmp_path, text)).system({}).A, reference_system()[0])


def test_a_matrix_in_a_csv_file_beside(tmp_path: Path) -> None:
    (tmp_path / "input.csv").write_text("# columns: delta, gust\n0, 0\nM_d, 0.1\n")
    text = PITCH.replace('[[0.0, 0.0], ["M_d", 0.1]]', '"input.csv"')
    file = load_state_space(written(tmp_path, text))
    np.testing.assert_array_equal(file.system({"M_d": 5.0}).B, [[0.0, 0.0], [5.0, 0.1]])
    assert [path.name for path in file.files] == ["model.toml", "input.csv"]


def test_the_states_are_the_outputs_where_no_others_are_named(tmp_path: Path) -> None:
    file = load_state_space(written(tmp_path, PITCH))
    np.testing.assert_array_equal(file.system({}).C, np.eye(2))
    assert (file.outputs, file.output_units) == (("theta", "q"), ("rad", "rad/s"))


@pytest.mark.theory
def test_feedback_with_an_integral_has_the_poles_of_its_polynomial(tmp_path: Path) -> None:
    """theta'' = M delta with the law of LAW: s^3 + M k_q s^2 + M k_theta s + M k_i."""
    file = load_state_space(written(tmp_path, PITCH + LAW))
    assert file.inputs == ("delta", "gust", "theta_ref")
    for M in (2.0, 3.0):
        expected = np.roots([1.0, M * 1.5, M * 3.0, M * 0.8])
        found = file.system({"M_d": M}).poles()
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12)


@pytest.mark.theory
def test_command_response_of_the_integral_law_is_its_transfer_function(tmp_path: Path) -> None:
    system = load_state_space(written(tmp_path, PITCH + LAW.replace("Ki =", "Kr = [[0.7]]\nKi ="))).system({})
    omega = np.geomspace(0.01, 50.0, 40)
    s = 1j * omega
    # M (K_r + k_i / s) / (s^2 + M k_q s + M k_theta + M k_i / s)
    expected = 2.0 * (0.7 + 0.8 / s) / (s**2 + 3.0 * s + 6.0 + 1.6 / s)
    np.testing.assert_allclose(system.frequency_response(2, 0, omega), expected, rtol=1e-11)


@pytest.mark.theory
def test_delay_inside_the_loop_is_exact_in_frequency(tmp_path: Path) -> None:
    text = PITCH.replace("late = 0.0", "late = 0.05") + LAW.replace("sign_x", "delay = 0.02\nsign_x")
    system = load_state_space(written(tmp_path, text)).system({})
    omega = np.geomspace(0.05, 80.0, 40)
    s = 1j * omega
    late = np.exp(-0.07 * s)
    expected = 2.0 * late * 0.8 / s / (s**2 + 2.0 * late * (1.5 * s + 3.0 + 0.8 / s))
    np.testing.assert_allclose(system.frequency_response(2, 0, omega), expected, rtol=1e-10)
    # an input of its own is late by the input's delay alone
    expected = 2.0 * np.exp(-0.05 * s) / (s**2 + 2.0 * late * (1.5 * s + 3.0 + 0.8 / s))
    np.testing.assert_allclose(system.frequency_response(0, 0, omega), expected, rtol=1e-10)


@pytest.mark.theory
def test_an_actuator_multiplies_the_response_of_its_input(tmp_path: Path) -> None:
    text = PITCH + '[[actuator]]\ninputs = ["delta"]\nomega = 12.0\nzeta = 0.7\n'
    omega = np.geomspace(0.1, 60.0, 30)
    s = 1j * omega
    plain, acted = (load_state_space(written(tmp_path, each)).system({}) for each in (PITCH, text))
    expected = plain.frequency_response(0, 0, omega) * 144.0 / (s**2 + 2 * 0.7 * 12.0 * s + 144.0)
    np.testing.assert_allclose(acted.frequency_response(0, 0, omega), expected, rtol=1e-12)
    np.testing.assert_allclose(acted.frequency_response(1, 0, omega), plain.frequency_response(1, 0, omega), rtol=1e-12)


@pytest.mark.theory
def test_allocation_gives_what_is_asked_at_the_least_cost() -> None:
    rng = np.random.default_rng(3)
    effect, weights = rng.normal(size=(3, 6)), rng.uniform(0.1, 100.0, 6)
    share = allocation(weights, effect)
    np.testing.assert_allclose(effect @ share, np.eye(3), atol=1e-12)
    # the Lagrange condition of the least weighted squares: W u lies in the row space of the effect
    residual = np.linalg.lstsq(effect.T, weights[:, None] * share, rcond=None)[1]
    assert np.abs(residual).max() < 1e-18 * np.abs(weights[:, None] * share).max() ** 2 + 1e-20


SHARED = (
    PITCH.replace('units = ["rad", "m/s"]', 'units = ["rad", "rad"]')
    + """\
[feedback]
controls = ["q_dot"]
internal = ["theta_c"]
states = ["q"]
Kx = [[2.0]]
sign_x = -1
Ki = [[5.0]]
sign_i = -1
[feedback.commands]
names = ["ref"]
units = ["rad"]
[[feedback.integral]]
of = { theta = 1.0, theta_c = -0.5 }
command = "ref"
[allocation]
controls = ["delta", "gust", "theta_c"]
weights = [1.0, 4.0, 2.0]
effect = [[2.0, 0.1, 0.3]]
"""
)


@pytest.mark.theory
def test_a_command_inside_the_law_is_its_share_of_the_allocation(tmp_path: Path) -> None:
    """q' = (2 m_1 + 0.1 m_2) m, e' = theta - 0.5 m_3 m - ref, m = -2 q - 5 e, with m_i the shares by hand."""
    shares = np.array([2.0 / 1.0, 0.1 / 4.0, 0.3 / 2.0])
    shares /= np.dot([2.0, 0.1, 0.3], shares)
    of_m, inner = 2.0 * shares[0] + 0.1 * shares[1], -0.5 * shares[2]
    A = [[0.0, 1.0, 0.0], [0.0, -2.0 * of_m, -5.0 * of_m], [1.0, -2.0 * inner, -5.0 * inner]]
    system = load_state_space(written(tmp_path, SHARED)).system({})
    np.testing.assert_allclose(system.A, A, rtol=1e-14)
    np.testing.assert_array_equal(system.B[:, 2], [0.0, 0.0, -1.0])


FAULTS = {
    "unknown key": (PITCH.replace("[matrices]", "[matrix]"), r"model.toml: unknown name 'matrix'; did you mean 'matrices'"),
    "unknown parameter": (PITCH.replace('"M_d", 0.1', '"M_e", 0.1'), r"matrices.B: 'M_e': unknown name 'M_e'; did you mean 'M_d'"),
    "shape": (PITCH.replace("[[0.0, 1.0], [0.0, 0.0]]", "[[0.0, 1.0]]"), r"matrices.A: has 1 rows of 2 entries, must be 2 by 2"),
    "C alone": (PITCH + "C = [[1.0, 0.0]]\n", r"matrices.C: C and \[outputs\] belong together"),
    "name twice": (PITCH.replace('"delta", "gust"', '"delta", "delta"'), r"inputs.names: 'delta' stands there twice"),
    "unit missing": (PITCH.replace('units = ["rad", "m/s"]', 'units = ["rad"]'), r"inputs.units: has 1 entries, must have 2"),
    "delay": (PITCH.replace("late = 0.0", "late = -0.1"), r"delay: is -0.1 s, must be 0 or more"),
    "number": (PITCH.replace("M_d = 2.0", "M_d = inf"), r"parameters.M_d: is inf"),
    "text": (PITCH.replace("A = [[0.0", "A = [[true"), r"model.toml: matrices.A: True is neither a finite number nor"),
    "actuator": (PITCH + '[[actuator]]\ninputs = ["delta"]\nomega = 0.0\nzeta = 0.7\n', r"actuator: needs omega above 0"),
    "actuator of nothing": (PITCH + '[[actuator]]\ninputs = ["dleta"]\nomega = 1.0\nzeta = 0.7\n', r"actuator.1.inputs: .*'delta'"),
    "control": (PITCH + LAW.replace('controls = ["delta"]', 'controls = ["dleta"]'), r"feedback.controls: .*did you mean 'delta'"),
    "sign": (PITCH + LAW.replace("sign_x = -1", ""), r"feedback.sign_x: missing"),
    "sign of the integral": (PITCH + LAW.replace("sign_i = -1", ""), r"feedback.Ki: Ki, sign_i and"),
    "command": (PITCH + LAW.replace('command = "theta_ref"', 'command = "theta"'), r"integral.1.command: .*'theta_ref'"),
    "integrand": (PITCH + LAW.replace("of = { theta", "of = { tehta"), r"integral.1.of: .*did you mean 'theta'"),
    "internal": (PITCH + LAW.replace("sign_x", 'internal = ["delta"]\nsign_x'), r"feedback.internal: 'delta' must be among"),
    "weights": (SHARED.replace("[1.0, 4.0, 2.0]", "[1.0, 0.0, 2.0]"), r"allocation.weights: must be positive, the least is 0"),
    "no effect": (SHARED.replace("[[2.0, 0.1, 0.3]]", "[[0.0, 0.0, 0.0]]"), r"allocation.effect: its 1 rows depend"),
    "allocation alone": (
        PITCH + '[allocation]\ncontrols = ["delta"]\nweights = [1.0]\neffect = [[1.0]]\n', r"allocation: shares the controls"
    ),
    "far file": (PITCH.replace("[[0.0, 1.0], [0.0, 0.0]]", '"../A.csv"'), r"matrices.A: '../A.csv' must be a path relative"),
    "no file": (PITCH.replace("[[0.0, 1.0], [0.0, 0.0]]", '"A.csv"'), r"matrices.A: no such file"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(fault: str, tmp_path: Path) -> None:
    text, message = FAULTS[fault]
    with pytest.raises(InputError, match=message):
        load_state_space(written(tmp_path, text))


@pytest.mark.parametrize("cell", ["nan", "1e999", "", "__import__('os')"])
def test_a_csv_cell_is_a_finite_number_or_a_parameter(cell: str, tmp_path: Path) -> None:
    (tmp_path / "A.csv").write_text(f"0, 1\n0, {cell}\n")
    with pytest.raises(InputError, match=r"model.toml: matrices"):
        load_state_space(written(tmp_path, PITCH.replace("[[0.0, 1.0], [0.0, 0.0]]", '"A.csv"')))
