"""Claims on bandwidth and phase delay, read on q / V_lon unless said otherwise, and on the sweep against the linearisation."""

from __future__ import annotations

import numpy as np

from levelone.campaign.claims.decision import Claim, Decision, Undecided, above, at_most, below, claim, decided, within
from levelone.campaign.claims.evidence import Evidence, defined
from levelone.campaign.claims.ranking import leading
from levelone.campaign.claims.samples import every_sample_at_level_1, percentiles

LEADING = ("M", "I_y", "K_T", "C_L0", "C_mq")
#: largest amplitude of a sweep that counts as small, m/s: a tenth of the step of attitude quickness
SMALL = 0.1
#: rad/s: what the sweep must cover, and the range over which the results compare it
COVERED = (0.5, 12.0)


@claim("omega-bw-range", "5th to 95th percentile of omega_bw (on q / V_lon) inside 3.6 to 5.5 rad/s", "omega_bw")
def spread(evidence: Evidence) -> Decision:
    """Linear reading."""
    low, _, high = percentiles(evidence.known("omega_bw"))
    return decided(f"{low:.3g} to {high:.3g} rad/s", {"p05": low, "p95": high}, within(low, 3.6, 5.5), within(high, 3.6, 5.5))


@claim("omega-bw-level", "every sample Level 1", "omega_bw_attitude", "tau_p_attitude")
def level(evidence: Evidence) -> Decision:
    """By the reading on attitude: that on q / V_lon has no Level."""
    condition, worse = every_sample_at_level_1(evidence, "bandwidth")
    runs = len(evidence.points)
    least = {name: float(np.nanmin(evidence.sample(name))) for name in ("omega_bw_attitude", "omega_bw")}
    here = f"{runs - worse} of {runs} samples Level 1 on attitude, smallest omega_bw there {least['omega_bw_attitude']:.3g} rad/s"
    here += f", on q / V_lon {least['omega_bw']:.3g} rad/s"
    numbers = {"below_level_1": float(worse), "n": float(runs)} | {f"{name}_min": value for name, value in least.items()}
    return decided(here, numbers, condition)


@claim("omega-bw-leading", "M, I_y, K_T, C_L0, C_mq: at least four in top(5) of ST", "omega_bw")
def leading_sobol(evidence: Evidence) -> Decision:
    """Places in ST."""
    return leading(evidence.sobol("omega_bw"), LEADING, "ST", first=5, least=4)


@claim("tau-p-spread", "relative standard deviation of tau_p below half that of omega_bw, at tau_d held nominal")
def delay_spread(evidence: Evidence) -> Decision:
    """The Monte Carlo points with tau_d at its nominal value; both deviations are of that sample."""
    evidence.check_inputs()
    found = evidence.section("without_delay")["responses"]
    relative = {}
    for name in ("tau_p", "omega_bw"):
        if name not in found:
            raise Undecided(f"the sample at nominal tau_d has no {name}")
        if found[name]["failed"]:
            raise Undecided(f"{name} is undefined in {found[name]['failed']} of {found[name]['n']} runs at nominal tau_d")
        relative[name] = defined(found[name]["std"] / abs(found[name]["mean"]), f"the relative deviation of {name}")
    here = f"tau_p {100.0 * relative['tau_p']:.2g} %, omega_bw {100.0 * relative['omega_bw']:.2g} %"
    return decided(here, relative, below(relative["tau_p"], 0.5 * relative["omega_bw"]))


@claim(
    "linear-sweep",
    "phase of the swept nonlinear response within 10 deg of the linear one over 0.5 to 12 rad/s at small amplitude, "
    "coherence above 0.6",
)
def linear_sweep(evidence: Evidence) -> Decision:
    """The smallest sweep flown, where it is small."""
    swept = [evidence.section("sweep"), *(evidence.summary.get("amplitudes") or [])]
    smallest = min(swept, key=lambda each: each["amplitude"])
    amplitude = smallest["amplitude"]
    if amplitude > SMALL * (1.0 + 1e-9):
        raise Undecided(f"the smallest sweep has {amplitude:g} m/s; up to {SMALL:g} m/s count as small")
    flown = evidence.summary["study"]["manoeuvres"]["bandwidth"]
    if flown["omega_min"] > COVERED[0] or flown["omega_max"] < COVERED[1]:
        raise Undecided(f"the sweep covers {flown['omega_min']:g} to {flown['omega_max']:g} rad/s, not 0.5 to 12 rad/s")
    phase = defined(smallest["max_phase_difference_deg"], "the phase difference", smallest["status"])
    coherence = defined(smallest["coherence_min"], "the coherence", smallest["status"])
    here = f"phase within {phase:.2g} deg, coherence above {coherence:.2g} with {amplitude:g} m/s"
    numbers = {"phase_deg": phase, "coherence": coherence, "amplitude": amplitude}
    return decided(here, numbers, at_most(phase, 10.0), above(coherence, 0.6))


CLAIMS: tuple[Claim, ...] = (spread, level, leading_sobol, delay_spread, linear_sweep)
