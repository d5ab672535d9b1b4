"""Direct decomposition: largest errors at 2^14 base points, and how often 95 % intervals hold the truth, on exact functions.

`pytest benchmarks/test_direct_coverage.py -s` prints the tables of docs/theory/direct-decomposition.md; some six CPU minutes.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "uncertainty"))
from uncertainty_functions import FUNCTIONS, REFERENCE, exact, exact_pairs, unit_space

from levelone.uncertainty import sobol, sobol_design
from levelone.uncertainty.pick_freeze import pick_freeze_ratios, pick_freeze_terms
from levelone.uncertainty.scrambling_intervals import scrambling_intervals

K, SEEDS, REPETITIONS = 14, 20, 200
ABOVE = np.triu_indices(K, 1)
ACTIVE = 0.001
ORDERS = ("S1", "ST", "S2")


def truth(name):
    """S1, ST and the pairs above the diagonal, one after another."""
    return np.concatenate([*exact(name, K), exact_pairs(name, K)[ABOVE]])


def order_of(values):
    """Which of ORDERS each value of :func:`truth` belongs to."""
    return np.repeat([0, 1, 2], [K, K, values.size - 2 * K])


def one(name, n, scramblings, seed, second_order=True):
    """Estimates [q] and intervals [q, 2] in the order of :func:`truth`."""
    design = sobol_design(unit_space(K), n, seed, second_order=second_order, scramblings=scramblings)
    found = sobol(design, FUNCTIONS[name](design.points))
    return np.concatenate([found.S1, found.ST, found.S2[ABOVE]]), np.concatenate([found.S1_ci, found.ST_ci, found.S2_ci[ABOVE]])


@pytest.mark.parametrize("scramblings", [1, 4, 8])
def test_largest_errors(scramblings):
    limits = [REFERENCE["direct"][f"{order}_error_most"] for order in ORDERS]
    print(f"\n{scramblings} scramblings of {2**14 // scramblings} base points: largest error, median / largest of {SEEDS} seeds")
    for name in FUNCTIONS:
        exactly = truth(name)
        error = np.abs([one(name, 2**14 // scramblings, scramblings, seed)[0] - exactly for seed in range(SEEDS)])
        worst = np.array([error[:, order_of(exactly) == order].max(axis=1) for order in range(3)])
        within = (worst <= np.array(limits)[:, None]).all(axis=0).sum()
        cells = ", ".join(f"{o} {np.median(w):.4f} / {w.max():.4f}" for o, w in zip(ORDERS, worst, strict=True))
        print(f"{name:10s} {cells}; all three within {limits} for {within} of {SEEDS}")
        if scramblings < 8:
            assert within >= 0.9 * SEEDS


@pytest.mark.parametrize(("scramblings", "n"), [(8, 128), (8, 512), (16, 256), (4, 1024)])
def test_coverage(scramblings, n):
    print(f"\n{scramblings} scramblings of {n} base points, {REPETITIONS} repetitions, indices above {ACTIVE}")
    for name in FUNCTIONS:
        runs = [one(name, n, scramblings, seed) for seed in range(REPETITIONS)]
        _print_coverage(name, runs, 3, check=scramblings >= 8)


def test_coverage_of_the_bootstrap_for_comparison():
    print(f"\nbootstrap, one scrambling of 4096 base points, {REPETITIONS // 4} repetitions")
    for name in FUNCTIONS:
        runs = [one(name, 4096, 1, seed, second_order=False) for seed in range(REPETITIONS // 4)]
        _print_coverage(name, runs, 2, check=False)


def _print_coverage(name, runs, orders, check=True):
    exactly, (estimates, intervals) = truth(name), (np.array(each) for each in zip(*runs, strict=True))
    held = ((intervals[..., 0] <= exactly) & (exactly <= intervals[..., 1])).mean(axis=0)
    width = np.median(np.diff(intervals, axis=-1)[..., 0], axis=0)
    for order in range(orders):
        mine = (order_of(exactly) == order) & (exactly > ACTIVE)
        ratio = width[mine] / (2.0 * 1.96 * estimates[:, mine].std(axis=0))
        print(
            f"{name:10s} {ORDERS[order]} of {mine.sum():2d}: held {held[mine].mean():.1%} (least {held[mine].min():.1%}), "
            f"width / spread {np.median(ratio):.2f} (most {ratio.max():.2f}), widest {width[mine].max():.4f}"
        )
        if check:
            assert held[mine].mean() >= REFERENCE["direct"]["coverage_least"]
            assert ratio.max() <= REFERENCE["direct"]["width_most"]


@pytest.mark.parametrize("width", [0.1, 0.05])
def test_coverage_where_sampling_stops_at_a_width(width):
    """Scramblings of 64 base points, four at a time from eight on, until the widest S1 or ST interval is narrow enough."""
    n, most = 64, 40
    print(f"\nuntil the widest interval is below {width}, {REPETITIONS} repetitions, indices above 0.01")
    for name in FUNCTIONS:
        exactly, held = truth(name), {1: [], 2: []}
        for seed in range(REPETITIONS):
            design = sobol_design(unit_space(K), n, 1000 + seed, second_order=True, scramblings=most)
            terms = pick_freeze_terms(FUNCTIONS[name](design.points).reshape(-1, design.block), True)
            for times, found in held.items():
                interval, used = _stop(terms, n, most, width, times)
                inside = (interval[:, 0] <= exactly) & (exactly <= interval[:, 1])
                found.append((inside[exactly > 0.01], used))
        for times, found in held.items():
            inside, used = np.array([each for each, _ in found]), np.median([each for _, each in found])
            least = inside.mean(axis=0).min()
            print(f"{name:10s} rule met {times} in a row: held {inside.mean():.1%} (least {least:.1%}), scramblings {used:.0f}")
            assert inside.mean() >= REFERENCE["direct"]["coverage_least"]


def _stop(terms, n, most, width, times):
    """Intervals where the rule was met ``times`` in a row, and the scramblings used."""
    ratios, met = partial(pick_freeze_ratios, k=K, second_order=True), 0
    for used in range(8, most + 1, 4):
        interval = scrambling_intervals(terms[: used * n], np.repeat(np.arange(used), n), ratios)
        met = met + 1 if np.diff(interval[: 2 * K], axis=1).max() <= width else 0
        if met == times:
            break
    return interval, used
