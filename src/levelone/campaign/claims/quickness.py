"""Claims on attitude quickness."""

from __future__ import annotations

from levelone.campaign.claims.decision import Claim, Decision, at_most, below, claim, decided, within
from levelone.campaign.claims.evidence import EXTENDED, Evidence, defined
from levelone.campaign.claims.inputs import AERODYNAMIC
from levelone.campaign.claims.ranking import leading
from levelone.campaign.claims.samples import every_sample_at_level_1, percentiles

MEDIAN = 2.875
LEADING = ("M", "I_y", "K_T", "tau_d", "C_L0")
MINOR = ("C_Lalpha", "T_u", "C_malpha")


@claim("quickness-median", "median of quickness within 10 % of 2.875 1/s", "quickness", calibrated=True)
def median(evidence: Evidence) -> Decision:
    """50th percentile of the sample."""
    _, middle, _ = percentiles(evidence.known("quickness"))
    return decided(f"median {middle:.3g} 1/s", {"median": middle}, within(middle, 0.9 * MEDIAN, 1.1 * MEDIAN))


@claim(
    "quickness-range",
    "5th to 95th percentile of quickness inside 2.25 to 3.6 1/s, and its width between 0.25 and 1.1 1/s",
    "quickness",
)
def spread(evidence: Evidence) -> Decision:
    """The width is that between the two percentiles."""
    low, _, high = percentiles(evidence.known("quickness"))
    inside = within(low, 2.25, 3.6), within(high, 2.25, 3.6)
    here = f"{low:.3g} to {high:.3g} 1/s, width {high - low:.2g} 1/s"
    return decided(here, {"p05": low, "p95": high, "width": high - low}, *inside, within(high - low, 0.25, 1.1))


@claim("quickness-level", "every sample above the Level 1/2 line, extrapolated below 5 deg", "quickness", "delta_theta_min")
def level(evidence: Evidence) -> Decision:
    """By the boundary extended straight beyond its range; a value on the line is Level 1."""
    condition, worse = every_sample_at_level_1(evidence, EXTENDED)
    runs = len(evidence.points)
    return decided(f"{runs - worse} of {runs} samples above", {"below_line": float(worse), "n": float(runs)}, condition)


@claim("quickness-leading-morris", "M, I_y, K_T, tau_d, C_L0: at least four in top(5) of mu_star and all in top(7)")
def leading_morris(evidence: Evidence) -> Decision:
    """Places in mu_star."""
    return leading(evidence.screening("quickness"), LEADING, "mu_star", first=5, least=4, last=7)


@claim("quickness-leading-sobol", "the same five: at least four in top(5) of ST and all in top(7)", "quickness")
def leading_sobol(evidence: Evidence) -> Decision:
    """Places in ST."""
    return leading(evidence.sobol("quickness"), LEADING, "ST", first=5, least=4, last=7)


@claim("quickness-minor", "C_Lalpha, T_u, C_malpha: each mu_star at most a third of the largest")
def minor(evidence: Evidence) -> Decision:
    """Parts of the largest mu_star of all inputs."""
    mu_star = evidence.screening("quickness")
    greatest = defined(max(mu_star.values()) or float("nan"), "the part of the largest mu_star on quickness", "all are 0")
    parts = {name: mu_star[name] / greatest for name in MINOR}
    here = ", ".join(f"{name} {part:.2g}" for name, part in parts.items()) + " of the largest mu_star"
    return decided(here, parts, *(at_most(part, 1.0 / 3.0) for part in parts.values()))


@claim("quickness-aerodynamics", "the nine aerodynamic factors together hold less than 35 % of the sum of S1", "quickness")
def aerodynamics(evidence: Evidence) -> Decision:
    """Estimates below zero enter both sums as they are."""
    first = evidence.sobol("quickness", "S1")
    total = sum(first.values())
    share = defined(sum(first[name] for name in AERODYNAMIC) / total if total > 0.0 else float("nan"), "the share of S1")
    return decided(f"{100.0 * share:.2g} % of the sum of S1", {"share": share}, below(share, 0.35))


CLAIMS: tuple[Claim, ...] = (median, spread, level, leading_morris, leading_sobol, minor, aerodynamics)
