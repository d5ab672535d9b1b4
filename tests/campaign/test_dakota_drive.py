"""The analysis driver: order, names, failures, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dakota_cases import ISHIGAMI, ishigami

from levelone.campaign.dakota.drive import drive
from levelone.errors import InputError
from levelone.uncertainty import Responses
from levelone.uncertainty.distributions import FloatArray


class Analytic:
    """zeta is Ishigami's function, failed where x2 > 2; tau_p is 100 x1 + 10 x2 + x3, so that an exchanged column shows."""

    names = ("tau_p", "zeta")

    def evaluate(self, points: FloatArray) -> Responses:
        """Responses at points."""
        first = points @ np.array([100.0, 10.0, 1.0])
        return Responses.from_values(np.column_stack([first, np.where(points[:, 1] > 2.0, np.nan, ishigami(points))]), self.names)


def block(x: tuple[float, float, float], identifier: str, responses: str = "1 ASV_1:zeta\n1 ASV_2:tau_p\n") -> str:
    """A standard parameters file whose variables stand in another order than the study's factors."""
    count = responses.count("ASV")
    variables = f"3 variables\n{x[2]!r} x3\n{x[0]!r} x1\n{x[1]!r} x2\n"
    tail = f"0 derivative_variables\n0 analysis_components\n{identifier} eval_id\n0 metadata\n"
    return f"{variables}{count} functions\n{responses}{tail}"


@pytest.fixture
def call(tmp_path: Path):
    def called(text: str):
        (tmp_path / "params.in").write_text(text)
        counts = drive(ISHIGAMI, Analytic(), tmp_path / "params.in", tmp_path / "results.out")
        return counts, (tmp_path / "results.out").read_text()

    return called


def test_values_follow_names_not_positions(call) -> None:
    x = (0.3, 0.5, 0.7)
    counts, text = call(block(x, "4"))
    zeta, tau_p = text.splitlines()
    assert zeta == f"{ishigami(np.array([x]))[0].item()!r} zeta"
    assert float(tau_p.split()[0]) == pytest.approx(35.7, rel=1e-15)
    assert counts == (1, 0)


def test_a_batch_keeps_its_order_and_its_separators(call) -> None:
    points = [(0.3, 0.5, 0.7), (0.1, 2.5, 0.2), (-1.0, -2.0, 3.0)]
    counts, text = call("".join(block(x, f"1:{i + 1}") for i, x in enumerate(points)))
    parts = text.split("#\n")
    assert [float(part.splitlines()[1].split()[0]) for part in parts] == pytest.approx([100 * a + 10 * b + c for a, b, c in points])
    assert parts[1].splitlines()[0] == "nan zeta"
    assert counts == (3, 1)


def test_only_what_is_asked_for_is_answered(call) -> None:
    _, text = call(block((0.3, 0.5, 0.7), "4", "0 ASV_1:zeta\n1 ASV_2:tau_p\n"))
    assert [line.split()[1] for line in text.splitlines()] == ["tau_p"]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (block((0.3, 0.5, 0.7), "4").replace(" x3", " x4"), "'x4'; did you mean 'x3'"),
        (block((0.3, 0.5, 0.7), "4").replace("3 variables\n0.7 x3\n", "2 variables\n"), "lacks the factor x3"),
        (block((0.3, 0.5, 0.7), "4", "1 ASV_1:zetta\n"), "did you mean 'zeta'"),
        (block((0.3, 0.5, 0.7), "4", "2 ASV_1:zeta\n"), "gradient"),
        (block((0.3, 0.5, 0.7), "4", "7 ASV_1:zeta\n"), "no_gradients"),
    ],
)
def test_what_cannot_be_answered_is_refused_and_nothing_is_written(call, tmp_path: Path, text: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        call(text)
    assert [path.name for path in tmp_path.iterdir()] == ["params.in"]


def test_a_results_file_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "params.in").write_text(block((0.3, 0.5, 0.7), "1"))
    with pytest.raises(InputError, match="results file"):
        drive(ISHIGAMI, Analytic(), tmp_path / "params.in", tmp_path / "no_folder" / "results.out")
