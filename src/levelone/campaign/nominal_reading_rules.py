"""Rules on what a criterion read: whether the sampling, the sweep and its coherence carry the numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from levelone.campaign.models.readings import Result, Spectral
from levelone.campaign.nominal_rules import Finding
from levelone.config.model_table import Test
from levelone.handling.damping import DynamicStability
from levelone.handling.history import TimeHistory
from levelone.handling.quickness import Quickness
from levelone.status import Status

SAMPLES = 20
"""Least samples in a half-cycle of the response that a peak is read from (assumed)."""
A_CYCLE = 5
"""Least samples in a cycle of the highest frequency that is read (assumed)."""
COHERENT = 0.8
"""Coherence below which a reading deserves a note (assumed); below the test's own least it looks wrong."""
HELD = 0.25
"""Largest part of a phase delay that half a sampling interval, the delay of a held input, may make up (assumed)."""


def reading_findings(test: Test, result: Result, history: TimeHistory | None) -> list[Finding]:
    """All findings on what a test read; ``history`` is the record, None for an exact response."""
    if isinstance(result, Quickness | DynamicStability) and history is not None:
        return list(_peaks(test, result, history))
    if isinstance(result, Spectral):
        return [
            *_range(test, result),
            *_coherence(test, result),
            *(_sampling(test, result, history) if history is not None else ()),
        ]
    return []


def _peaks(test: Test, result: Quickness | DynamicStability, history: TimeHistory) -> Iterator[Finding]:
    half_cycle = float(result.picks.half_cycle[0])
    if math.isfinite(half_cycle) and half_cycle < SAMPLES * history.dt:
        yield Finding(
            "sampling",
            test.name,
            f"a half-cycle of the response lasts {half_cycle:.3g} s, {half_cycle / history.dt:.3g} samples; take {SAMPLES} or "
            f"more: dt below {half_cycle / SAMPLES:.2g} s",
        )


def _range(test: Test, result: Spectral) -> Iterator[Finding]:
    reading, last = result.reading, float(result.response.omega[-1])
    if int(reading.status_180) == Status.OK and 2.0 * float(reading.omega_180) > last:
        yield Finding(
            "range",
            test.name,
            f"the response ends at {last:.4g} rad/s, below 2 omega_180 = {2.0 * float(reading.omega_180):.4g} rad/s: phase delay "
            "cannot be read; raise omega_max",
        )
    first = float(result.response.omega[0])
    bandwidth = float(reading.omega_bw)
    if math.isfinite(bandwidth) and bandwidth < 2.0 * first:
        yield Finding(
            "range",
            test.name,
            f"bandwidth {bandwidth:.3g} rad/s lies at the lower end of the response, {first:.3g} rad/s: lower omega_min",
        )


def _coherence(test: Test, result: Spectral) -> Iterator[Finding]:
    response, reading = result.response, result.reading
    if response.coherence is None:
        return
    end = 2.0 * float(reading.omega_180) if int(reading.status_180) == Status.OK else float(response.omega[-1])
    inside = response.omega <= end
    coherence = np.where(np.isfinite(response.coherence), response.coherence, 0.0)[inside]
    worst = int(np.argmin(coherence))
    if coherence[worst] < COHERENT:
        yield Finding(
            "coherence",
            test.name,
            f"coherence falls to {coherence[worst]:.2f} at {response.omega[inside][worst]:.3g} rad/s, within the range up to "
            f"{end:.3g} rad/s: a larger amplitude, a longer sweep or longer windows may help",
            wrong=bool(coherence[worst] < test.coherence_min),
        )


def _sampling(test: Test, result: Spectral, history: TimeHistory) -> Iterator[Finding]:
    reading, dt = result.reading, history.dt
    highest = 2.0 * float(reading.omega_180)
    if math.isfinite(highest) and 2.0 * math.pi / highest < A_CYCLE * dt:
        yield Finding(
            "sampling",
            test.name,
            f"2 omega_180 = {highest:.3g} rad/s has {2.0 * math.pi / (highest * dt):.2g} samples a cycle; take {A_CYCLE} or more: "
            f"dt below {2.0 * math.pi / (highest * A_CYCLE):.2g} s",
        )
    delay = float(reading.tau_p)
    if math.isfinite(delay) and delay > 0.0 and 0.5 * dt > HELD * delay:
        yield Finding(
            "sampling",
            test.name,
            f"half a sampling interval, {0.5 * dt:.2g} s, is {50.0 * dt / delay:.3g} % of the phase delay, {delay:.3g} s; a model "
            "that holds its input between samples adds it: take a smaller dt",
        )
