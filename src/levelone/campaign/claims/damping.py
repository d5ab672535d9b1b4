"""Claims on dynamic stability: natural frequency and damping ratio."""

from __future__ import annotations

import math

import numpy as np

from levelone.campaign.claims.decision import Claim, Decision, Undecided, above, at_least, claim, decided, within
from levelone.campaign.claims.evidence import Evidence, defined
from levelone.campaign.claims.inputs import AERODYNAMIC
from levelone.campaign.claims.ranking import leading, top
from levelone.handling.levels import Level

OMEGA_N = 5.61
ALSO = ("C_Lq", "C_Dalpha", "C_malpha")


@claim("omega-n-nominal", "omega_n within 5 % of 5.61 rad/s", calibrated=True)
def nominal(evidence: Evidence) -> Decision:
    """Of the nominal vehicle."""
    omega_n = evidence.nominal("omega_n")
    return decided(f"{omega_n:.3g} rad/s", {"omega_n": omega_n}, within(omega_n, 0.95 * OMEGA_N, 1.05 * OMEGA_N))


@claim(
    "zeta-boundary",
    "share(Level 1 of dynamic stability) between 0.5 and 0.95, and mean of zeta within 0.05 of 0.35",
    "zeta", "omega_n",
)  # fmt: skip
def boundary(evidence: Evidence) -> Decision:
    """The share is of all runs, undefined ones included."""
    share = float((evidence.level("dynamic_stability") == Level.LEVEL_1).mean())
    mean = float(evidence.known("zeta").mean())
    here = f"{100.0 * share:.3g} % Level 1, mean {mean:.3g}"
    return decided(here, {"level_1": share, "mean": mean}, within(share, 0.5, 0.95), within(mean, 0.30, 0.40))


@claim("zeta-spread", "standard deviation of zeta between 0.01 and 0.06", "zeta")
def spread(evidence: Evidence) -> Decision:
    """With n - 1."""
    std = float(evidence.known("zeta").std(ddof=1))
    return decided(f"standard deviation {std:.2g}", {"std": std}, within(std, 0.01, 0.06))


@claim("zeta-leading", "C_L0 and C_mq in top(6) of mu_star for zeta")
def leading_morris(evidence: Evidence) -> Decision:
    """Places in mu_star."""
    return leading(evidence.screening("zeta"), ("C_L0", "C_mq"), "mu_star", first=6)


@claim(
    "zeta-nonlinear",
    "sigma / mu_star > 0.5 for M and tau_d on zeta, larger than for any aerodynamic factor of the top(6)",
)
def nonlinear(evidence: Evidence) -> Decision:
    """The top(6) is that of mu_star; without an aerodynamic factor in it, the second part holds."""
    mu_star, sigma = evidence.screening("zeta"), evidence.screening("zeta", "sigma")
    ratio = {name: sigma[name] / mu_star[name] for name in mu_star if mu_star[name] > 0.0}
    for name in ("M", "tau_d"):
        defined(ratio.get(name, math.nan), f"sigma / mu_star of {name} on zeta", "mu_star is 0")
    rivals = [name for name in top(mu_star, 6) if name in AERODYNAMIC]
    largest = max((ratio[name] for name in rivals), default=0.0)
    conditions = [condition for name in ("M", "tau_d") for condition in (above(ratio[name], 0.5), above(ratio[name], largest))]
    here = f"M {ratio['M']:.2g}, tau_d {ratio['tau_d']:.2g}; aerodynamic factors of the top(6) "
    here += f"up to {largest:.2g} ({max(rivals, key=lambda name: ratio[name])})" if rivals else "none"
    return decided(here, {"M": ratio["M"], "tau_d": ratio["tau_d"], "largest_aerodynamic": largest}, *conditions)


@claim("zeta-mass-total", "ST - S1 > 0.1 for M on zeta", "zeta")
def mass_total(evidence: Evidence) -> Decision:
    """What M does to zeta together with other inputs."""
    beyond = evidence.sobol("zeta")["M"] - evidence.sobol("zeta", "S1")["M"]
    return decided(f"ST - S1 {beyond:.2g}", {"beyond": beyond}, above(beyond, 0.1))


@claim(
    "zeta-level-2-corner",
    "Level 2 samples: the share with M below nominal and tau_d above 0.015 s is at least twice that of all samples",
    "zeta", "omega_n",
)  # fmt: skip
def level_2_corner(evidence: Evidence) -> Decision:
    """Level 2 of dynamic stability; undecidable where no sample has it, or none lies in the corner."""
    level_2 = evidence.level("dynamic_stability") == Level.LEVEL_2
    if not level_2.any():
        raise Undecided("no sample is Level 2 in dynamic stability")
    there = (evidence.point("M") < evidence.nominal_input("M")) & (evidence.point("tau_d") > 0.015)
    if not there.any():
        raise Undecided("no sample has M below nominal and tau_d above 0.015 s")
    share, of_all = float(np.mean(there[level_2])), float(there.mean())
    here = f"{100.0 * share:.3g} % of {int(level_2.sum())} Level 2 samples against {100.0 * of_all:.3g} % of all"
    return decided(here, {"share": share, "share_of_all": of_all}, at_least(share, 2.0 * of_all))


@claim("omega-n-also", "C_Lq, C_Dalpha, C_malpha: each mu_star for omega_n at least 3 % of the largest")
def also(evidence: Evidence) -> Decision:
    """Parts of the largest mu_star of all inputs."""
    mu_star = evidence.screening("omega_n")
    greatest = defined(max(mu_star.values()) or math.nan, "the part of the largest mu_star on omega_n", "all are 0")
    parts = {name: mu_star[name] / greatest for name in ALSO}
    here = ", ".join(f"{name} {100.0 * part:.2g} %" for name, part in parts.items()) + " of the largest mu_star"
    return decided(here, parts, *(at_least(part, 0.03) for part in parts.values()))


CLAIMS: tuple[Claim, ...] = (nominal, boundary, spread, leading_morris, nonlinear, mass_total, level_2_corner, also)
