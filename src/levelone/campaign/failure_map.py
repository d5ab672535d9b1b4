"""Where in the factor box evaluations failed: factor by factor, and in the plane of the two factors that separate them best.

The two factors are those whose 4 by 4 table of quarters tells most about whether an evaluation fails: the largest mutual
information, less its bias of (occupied cells - 1) / (2 n) nat under chance (G. A. Miller, "Note on the bias of information
estimates", in Information Theory in Psychology, Free Press 1955, pp. 95-100). The best of many pairs looks good by chance as well:
the failures are dealt out anew among the evaluations, and the share of deals whose own best pair is as good is the pair's p-value
(P. H. Westfall, S. S. Young, Resampling-Based Multiple Testing, Wiley 1993: the distribution of the maximum).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import xlogy

from levelone.campaign.models.protocol import STANDS, FloatArray, IntArray
from levelone.campaign.store_reader import outcomes, status_name, status_text
from levelone.errors import InputError

Json = dict[str, Any]
#: quarters of each factor
BINS = 4
#: deals of the failures, so that no p-value is below 1/200
DEALS = 199
#: failures that are dealt; of more, and of the others in proportion, a random part is looked at
DEALT = 4000
#: evaluations that the picture shows, of those that failed and of the others
SHOWN = 2000


@dataclass(frozen=True, eq=False)
class BestPair:
    """The two factors in whose plane failures separate best.

    Parameters
    ----------
    factors
        Their columns.
    information
        Mutual information of table and failure, bit, less its bias under chance; may be negative.
    alone
        The same of each of the two factors without the other.
    p_value
        Share of random deals of the failures whose best pair tells as much.
    runs, failed
        [BINS, BINS] numbers of evaluations and of failures; rows are quarters of the first factor.
    """

    factors: tuple[int, int]
    information: float
    alone: tuple[float, float]
    p_value: float
    runs: IntArray
    failed: IntArray


def failure_map(
    unit_points: FloatArray, points: FloatArray, status: IntArray, factors: Sequence[str], units: Sequence[str],
    responses: Sequence[str], seed: int,
) -> Json:  # fmt: skip
    """The block ``failure_map`` of the results.

    Parameters
    ----------
    unit_points
        [n, k] positions in the unit cube: ``Design.unit_points``.
    points
        [n, k] physical values, in ``units``.
    status
        [n, m] codes of :class:`levelone.status.Status`.
    factors, units
        The k factors.
    responses
        The m responses.
    seed
        Of the study; the deals are a stage of their own, see :func:`levelone.uncertainty.stage_seed`.

    Returns
    -------
    dict
        ``runs``, ``failed`` (evaluations with a response undefined), ``outcomes``, and where any failed ``factors`` and, for two
        factors or more, ``pair`` and ``shown``.

    Raises
    ------
    InputError
        Shapes that do not fit.
    """
    n = len(status)
    for name, array in (("unit_points", unit_points), ("points", points)):
        if array.shape != (n, len(factors)):
            raise InputError(name, f"shape {array.shape}; [{n}, {len(factors)}] is needed")
    codes = outcomes(status)
    failed = codes != 0
    found: Json = {"runs": n, "failed": int(failed.sum()), "outcomes": outcome_rows(status, responses)}
    if not failed.any():
        return found
    found["factors"] = factor_rows(unit_points, failed, factors)
    pair = best_pair(unit_points, failed, seed)
    if pair is not None:
        found["pair"] = {
            "factors": [factors[i] for i in pair.factors], "information": pair.information,
            "alone": list(pair.alone), "p_value": pair.p_value,
            "runs": pair.runs.tolist(), "failed": pair.failed.tolist(),
        }  # fmt: skip
    found["shown"] = _shown(unit_points, points, codes, (factors, units), pair.factors if pair else (0, 0))
    return found


def outcome_rows(status: IntArray, responses: Sequence[str]) -> list[Json]:
    """What was the matter, the most frequent first: each evaluation counts once, under its first cause."""
    codes = outcomes(status)
    lost = ~np.isin(status, STANDS)
    rows = []
    for code in np.unique(codes[codes != 0]):
        mine = codes == code
        rows.append({
            "name": status_name(int(code)), "status": status_text(int(code)), "evaluations": int(mine.sum()),
            "all_responses": int(lost[mine].all(axis=1).sum()),
            "responses": [name for name, some in zip(responses, lost[mine].any(axis=0), strict=True) if some],
        })  # fmt: skip
    return sorted(rows, key=lambda row: -row["evaluations"])


def factor_rows(unit_points: FloatArray, failed: NDArray[np.bool_], factors: Sequence[str]) -> list[Json]:
    """Each factor's mean position among the failed and among all, a rank test, and the failed in each quarter; least p first."""
    from levelone.uncertainty import failure_corner

    found = failure_corner(unit_points, failed, factors)
    quarters = _quarters(unit_points)
    rows = [
        {
            "factor": name, "mean_failed": float(found.mean_failed[j]), "mean_all": float(found.mean_all[j]),
            "p_value": float(found.p_value[j]), "runs": np.bincount(quarters[:, j], minlength=BINS).tolist(),
            "failed": np.bincount(quarters[failed, j], minlength=BINS).tolist(),
        }
        for j, name in enumerate(factors)
    ]  # fmt: skip
    return sorted(rows, key=lambda row: row["p_value"] if row["p_value"] == row["p_value"] else 2.0)


def best_pair(unit_points: FloatArray, failed: NDArray[np.bool_], seed: int) -> BestPair | None:
    """The pair of factors that tells most about ``failed`` [n]; None where there is no pair, or nothing to tell apart."""
    k = unit_points.shape[1]
    if k < 2 or failed.all() or not failed.any():
        return None
    from levelone.uncertainty import stage_seed

    rng = np.random.default_rng(stage_seed(seed, "failure map"))
    pairs, quarters = list(combinations(range(k), 2)), _quarters(unit_points)
    best, p_value = _search(quarters, failed, pairs, rng)
    i, j = pairs[best]
    cells = BINS * quarters[:, i] + quarters[:, j]
    runs, count = (np.bincount(x, minlength=BINS**2).reshape(BINS, BINS) for x in (cells, cells[failed]))
    told, first, second = (
        float(_information(x.reshape(1, -1), y.reshape(1, -1))[0])
        for x, y in ((count, runs), (count.sum(axis=1), runs.sum(axis=1)), (count.sum(axis=0), runs.sum(axis=0)))
    )
    return BestPair((i, j), told, (first, second), p_value, runs, count)


def _search(
    quarters: IntArray, failed: NDArray[np.bool_], pairs: Sequence[tuple[int, int]], rng: np.random.Generator
) -> tuple[int, float]:
    """Number of the best pair and its p-value."""
    few = int(failed.sum())
    if few > DEALT:
        kept = rng.choice(failed.size, failed.size * DEALT // few, replace=False)
        quarters, failed = quarters[kept], failed[kept]
    # one number for each pair and cell, so that one count does all pairs
    cells = np.stack([BINS**2 * p + BINS * quarters[:, i] + quarters[:, j] for p, (i, j) in enumerate(pairs)])
    size, n = BINS**2 * len(pairs), failed.size
    runs = np.bincount(cells.ravel(), minlength=size).reshape(-1, BINS**2)

    def told(rows: IntArray) -> FloatArray:
        return _information(np.bincount(cells[:, rows].ravel(), minlength=size).reshape(-1, BINS**2), runs)

    rows = np.flatnonzero(failed)
    seen = told(rows)
    best = int(np.argmax(seen))
    least = seen[best] - 1e-12  # the same table in another order of sums counts as equal
    as_good = sum(told(rng.choice(n, rows.size, replace=False)).max() >= least for _ in range(DEALS))
    return best, float((1 + as_good) / (1 + DEALS))


def _information(failed: IntArray, runs: IntArray) -> FloatArray:
    """Mutual information [tables] of cell and failure, bit, less its bias, from counts [tables, cells]."""
    n, occupied = runs[0].sum(), (runs > 0).sum(axis=1)
    conditional = (runs / n * _entropy(failed / np.maximum(runs, 1))).sum(axis=1)
    share = _entropy(failed[0].sum(keepdims=True) / n)
    return share - conditional - (occupied - 1) / (2.0 * n * np.log(2.0))


def _entropy(share: FloatArray) -> FloatArray:
    """Entropy of a yes or no, bit; zero where it is certain."""
    return -(xlogy(share, share) + xlogy(1.0 - share, 1.0 - share)) / np.log(2.0)


def _quarters(unit_points: FloatArray) -> IntArray:
    return np.clip((unit_points * BINS).astype(np.int64), 0, BINS - 1)


def _shown(
    unit_points: FloatArray, points: FloatArray, codes: IntArray, named: tuple[Sequence[str], Sequence[str]], pair: tuple[int, int]
) -> Json:
    """What the picture needs: all that failed and some of the others, evenly over the sample, in the plane of the pair."""
    failed, good = _some(np.flatnonzero(codes != 0)), _some(np.flatnonzero(codes == 0))
    kept = np.concatenate([failed, good])
    (names, units), words = named, [status_name(int(code)) for code in codes[failed]]
    return {
        "x": points[kept, pair[0]].tolist(), "y": points[kept, pair[1]].tolist(), "outcome": [*words, *["ok"] * good.size],
        "factors": [names[i] for i in pair], "units": [units[i] for i in pair], "order": list(names),
        "positions": unit_points[failed].tolist(),
        "of": [int((codes != 0).sum()), int((codes == 0).sum())],
    }  # fmt: skip


def _some(rows: IntArray) -> IntArray:
    return rows if rows.size <= SHOWN else rows[np.linspace(0, rows.size - 1, SHOWN).astype(np.int64)]
