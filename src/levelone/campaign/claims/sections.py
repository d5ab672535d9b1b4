"""Claims on the cases of the study's Tables 3 to 5, on pitch-roll coupling, and on the agreement of both rankings."""

from __future__ import annotations

import math
from typing import Any

from levelone.campaign.claims.decision import (
    Claim,
    Condition,
    Decision,
    Undecided,
    above,
    at_least,
    at_most,
    below,
    claim,
    decided,
    within,
)
from levelone.campaign.claims.evidence import Evidence, defined
from levelone.uncertainty import rank_agreement

#: responses that the study decomposes by both methods
RANKED = ("quickness", "delta_theta_min", "zeta", "omega_n", "omega_bw", "tau_p")


def cases(evidence: Evidence, table: int, criterion: str, count: int, response: str) -> list[float]:
    """Values of one response over the cases of a table of the study, case 1 first."""
    block: Any = evidence.section("cases").get(criterion)
    if block is None:
        raise Undecided(f"the study flies no cases of {criterion}")
    if f"Table {table}" not in block["source"] or len(block["rows"]) != count:
        given = f"{block['source']}, {len(block['rows'])} rows"
        raise Undecided(f"the cases of {criterion} ({given}) are not the {count} of the study's Table {table}")
    rows = zip(block["values"][response], block["status"][response], strict=True)
    return [defined(value, f"{response} of case {i}", status) for i, (value, status) in enumerate(rows, 1)]


@claim("table-3-quickness", "largest quickness of cases 2 to 5 at most 6 % above case 1")
def table_3_quickness(evidence: Evidence) -> Decision:
    """Table 3, on the nonlinear model."""
    first, *others = cases(evidence, 3, "attitude_quickness", 5, "quickness")
    ratio = max(others) / first
    return decided(f"at most {100.0 * (ratio - 1.0):+.2g} %", {"ratio": ratio}, at_most(ratio, 1.06))


@claim("table-3-delta-theta-min", "delta_theta_min of cases 2 to 5 between -7 % and +10 % of case 1")
def table_3_attitude(evidence: Evidence) -> Decision:
    """Table 3, on the nonlinear model."""
    first, *others = cases(evidence, 3, "attitude_quickness", 5, "delta_theta_min")
    low, high = min(others) / first, max(others) / first
    here = f"{100.0 * (low - 1.0):+.2g} to {100.0 * (high - 1.0):+.2g} %"
    return decided(here, {"lowest_ratio": low, "highest_ratio": high}, at_least(low, 0.93), at_most(high, 1.10))


@claim("table-4-C_L0", "zeta of case 2 above case 1")
def table_4_lift(evidence: Evidence) -> Decision:
    """Table 4, on the nonlinear model."""
    first, second, *_ = cases(evidence, 4, "dynamic_stability", 4, "zeta")
    here = f"{second:.4f} against {first:.4f}"
    return decided(here, {"case_1": first, "case_2": second}, above(second, first))


@claim("table-4-C_mq", "case 4 against case 3: zeta larger, omega_n smaller")
def table_4_damping(evidence: Evidence) -> Decision:
    """Table 4, on the nonlinear model."""
    zeta = cases(evidence, 4, "dynamic_stability", 4, "zeta")
    omega_n = cases(evidence, 4, "dynamic_stability", 4, "omega_n")
    here = f"zeta {zeta[3]:.4g} against {zeta[2]:.4g}, omega_n {omega_n[3]:.4g} against {omega_n[2]:.4g} rad/s"
    numbers = {"zeta_3": zeta[2], "zeta_4": zeta[3], "omega_n_3": omega_n[2], "omega_n_4": omega_n[3]}
    return decided(here, numbers, above(zeta[3], zeta[2]), below(omega_n[3], omega_n[2]))


@claim("table-5-tau-p", "tau_p of case 4 between 10 and 25 % below case 3; cases 2 and 3 within 5 % of case 1")
def table_5_delay(evidence: Evidence) -> Decision:
    """Table 5, by the linear reading on q / V_lon as everywhere; the swept reading is beside it in the results."""
    tau_p = cases(evidence, 5, "bandwidth", 5, "tau_p")
    drop = 1.0 - tau_p[3] / tau_p[2]
    near = {i: tau_p[i - 1] / tau_p[0] - 1.0 for i in (2, 3)}
    here = f"case 4 {-100.0 * drop:+.2g} % of case 3; cases 2, 3 {100.0 * near[2]:+.2g}, {100.0 * near[3]:+.2g} % of case 1"
    numbers = {"case_4_below_3": drop, "case_2": near[2], "case_3": near[3]}
    return decided(here, numbers, within(drop, 0.10, 0.25), *(at_most(abs(each), 0.05) for each in near.values()))


@claim("table-5-omega-bw", "case 5 moves omega_bw from case 1 at least twice as much as any of cases 2 to 4")
def table_5_bandwidth(evidence: Evidence) -> Decision:
    """Table 5, by the linear reading on q / V_lon."""
    first, *others = cases(evidence, 5, "bandwidth", 5, "omega_bw")
    moved = [abs(each - first) for each in others]
    here = f"case 5 by {moved[3]:.2g} rad/s, cases 2 to 4 by at most {max(moved[:3]):.2g} rad/s"
    return decided(here, {f"case_{i}": by for i, by in enumerate(moved, 2)}, at_least(moved[3], 2.0 * max(moved[:3])))


@claim(
    "coupling",
    "roll response to the pitch manoeuvre Level 1 in every sample, and each roll factor's mu_star below 1 % of the largest "
    "for the pitch responses",
)
def coupling(evidence: Evidence) -> Decision:
    """Samples are the runs of the screening with the roll factors; Levels are by the ratio to the on-axis peak."""
    block = evidence.section("coupling")
    shares, runs = block["level_shares"], block["n"]
    if not block["added"]:
        raise Undecided("the screening of coupling has no roll factors")
    level_1 = defined(shares["level_1"], "the share of Level 1")
    unknown = shares["outside"] + shares["failed"]
    if unknown > 0.0 and level_1 + unknown >= 1.0 - 1e-12:
        raise Undecided(f"{100.0 * unknown:.2g} % of the runs have no Level, all others are Level 1")
    largest = max(_roll_part(block, response, name) for response in RANKED for name in block["added"])
    here = f"{100.0 * level_1:.3g} % of {runs} runs Level 1; roll factors up to {100.0 * largest:.2g} % of the largest mu_star"
    level = Condition(level_1 >= 1.0 - 1e-12, 1.0 - level_1)
    return decided(here, {"level_1": level_1, "largest_part": largest}, level, below(largest, 0.01))


def _roll_part(block: Any, response: str, factor: str) -> float:
    """mu_star of a roll factor as a part of the largest on a pitch response."""
    mu_star = block["mu_star"].get(response)
    if mu_star is None:
        raise Undecided(f"the screening of coupling has no {response}")
    greatest = defined(max(mu_star.values()) or math.nan, f"the part of the largest mu_star on {response}", "all are 0")
    return defined(mu_star[factor] / greatest, f"mu_star of {factor} on {response}")


@claim("morris-sobol", "Spearman correlation of mu_star and ST at least 0.8 for every response", *RANKED)
def rankings(evidence: Evidence) -> Decision:
    """For the six responses that the study decomposes; an undefined correlation leaves the rule undecided."""
    found = {
        name: defined(_agreement(evidence.screening(name), evidence.sobol(name)), f"the correlation for {name}") for name in RANKED
    }
    lowest = min(found, key=lambda name: found[name])
    return decided(f"lowest {found[lowest]:.3g} ({lowest})", found, *(at_least(each, 0.8) for each in found.values()))


def _agreement(mu_star: dict[str, float], total: dict[str, float]) -> float:
    return rank_agreement([mu_star[name] for name in total], list(total.values()))


CLAIMS: tuple[Claim, ...] = (
    table_3_quickness, table_3_attitude, table_4_lift, table_4_damping, table_5_delay, table_5_bandwidth, coupling, rankings,
)  # fmt: skip
