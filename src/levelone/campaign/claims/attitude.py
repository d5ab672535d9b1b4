"""Claims on the change of attitude in the step: its peak and its smallest value."""

from __future__ import annotations

import math

import numpy as np

from levelone.campaign.claims.decision import Claim, Decision, above, at_least, below, claim, decided
from levelone.campaign.claims.evidence import Evidence, defined
from levelone.campaign.claims.ranking import leading
from levelone.campaign.claims.samples import every_sample_at_most, largest

LEADING = ("I_y", "K_T", "C_L0", "C_Lalpha", "C_mq")
DRAG = ("C_D0", "C_Dalpha")
BESIDE = ("quickness", "zeta", "omega_bw", "tau_p")


@claim(
    "attitude-limits",
    "delta_theta_pk <= 13 deg and delta_theta_min <= 5 deg in every sample",
    "delta_theta_pk", "delta_theta_min",
)  # fmt: skip
def limits(evidence: Evidence) -> Decision:
    """One sample beyond a limit decides; undefined samples are not within."""
    peak, largest_peak = every_sample_at_most(evidence, "delta_theta_pk", math.radians(13.0))
    least, largest_least = every_sample_at_most(evidence, "delta_theta_min", math.radians(5.0))
    shown = {"delta_theta_pk_max_deg": math.degrees(largest_peak), "delta_theta_min_max_deg": math.degrees(largest_least)}
    words = "largest delta_theta_pk {:.3g} deg, delta_theta_min {:.3g} deg"
    return decided(words.format(*shown.values()), shown, peak, least)


@claim("delta-theta-min-leading", "I_y, K_T, C_L0, C_Lalpha, C_mq: at least four in top(6) of mu_star")
def leading_morris(evidence: Evidence) -> Decision:
    """Places in mu_star."""
    return leading(evidence.screening("delta_theta_min"), LEADING, "mu_star", first=6, least=4)


@claim(
    "delta-theta-min-drag",
    "C_D0 and C_Dalpha have a larger share of ST for delta_theta_min than for quickness, zeta, omega_bw and tau_p",
    "delta_theta_min", *BESIDE,
)  # fmt: skip
def drag(evidence: Evidence) -> Decision:
    """Each of the two by itself; a share is of the sum of ST over all inputs."""
    shares = {name: _shares(evidence, name) for name in ("delta_theta_min", *BESIDE)}
    conditions = [above(shares["delta_theta_min"][factor], shares[other][factor]) for factor in DRAG for other in BESIDE]
    numbers: dict[str, float] = {}
    words = []
    for factor in DRAG:
        own = shares["delta_theta_min"][factor]
        most = max(BESIDE, key=lambda other: shares[other][factor])
        numbers |= {f"{factor}_{name}": shares[name][factor] for name in shares}
        words.append(f"{factor} {100.0 * own:.2g} %, elsewhere up to {100.0 * shares[most][factor]:.2g} % ({most})")
    return decided("share of ST: " + "; ".join(words), numbers, *conditions)


def _shares(evidence: Evidence, response: str) -> dict[str, float]:
    total = evidence.sobol(response)
    whole = defined(sum(total.values()) or math.nan, f"the share of ST on {response}", "all are 0")
    return {factor: total[factor] / whole for factor in DRAG}


@claim("delta-theta-min-interaction", "ST - S1 > S1 for M and for tau_d", "delta_theta_min")
def interaction(evidence: Evidence) -> Decision:
    """On delta_theta_min."""
    first, total = evidence.sobol("delta_theta_min", "S1"), evidence.sobol("delta_theta_min")
    numbers: dict[str, float] = {}
    words, conditions = [], []
    for name in ("M", "tau_d"):
        beyond = total[name] - first[name]
        numbers |= {f"S1_{name}": first[name], f"ST_{name}": total[name]}
        words.append(f"{name} {beyond:.2g} against S1 {first[name]:.2g}")
        conditions.append(above(beyond, first[name]))
    return decided("ST - S1: " + ", ".join(words), numbers, *conditions)


@claim(
    "delta-theta-min-small-spread",
    "standard deviation of delta_theta_min below 12 % of its mean outside the outliers (beyond 3 interquartile ranges)",
    "delta_theta_min",
)
def small_spread(evidence: Evidence) -> Decision:
    """Outliers lie more than 3 interquartile ranges below the first or above the third quartile; mean and deviation are without."""
    values = evidence.known("delta_theta_min")
    first, third = np.quantile(values, (0.25, 0.75))
    reach = 3.0 * (third - first)
    kept = values[(values >= first - reach) & (values <= third + reach)]
    ratio = float(kept.std(ddof=1) / kept.mean())
    outliers = values.size - kept.size
    here = f"{100.0 * ratio:.2g} % of the mean, {outliers} outliers left out"
    return decided(here, {"relative_std": ratio, "outliers": float(outliers)}, below(ratio, 0.12))


@claim(
    "corner",
    "of the samples in the top 1 % of delta_theta_min or quickness, at least two thirds have M below nominal "
    "and tau_d above 0.02 s",
    "delta_theta_min", "quickness",
)  # fmt: skip
def corner(evidence: Evidence) -> Decision:
    """A sample in the top 1 % of either response counts once; 1 % is rounded up to whole samples."""
    either = largest(evidence.sample("delta_theta_min"), 0.01) | largest(evidence.sample("quickness"), 0.01)
    there = (evidence.point("M") < evidence.nominal_input("M")) & (evidence.point("tau_d") > 0.02)
    count, inside = int(either.sum()), int((either & there).sum())
    here = f"{inside} of {count} samples, {100.0 * float(there.mean()):.2g} % of all"
    numbers = {"top": float(count), "in_corner": float(inside), "share_of_all": float(there.mean())}
    return decided(here, numbers, at_least(3.0 * inside, 2.0 * count))


CLAIMS: tuple[Claim, ...] = (limits, leading_morris, drag, interaction, small_spread, corner)
