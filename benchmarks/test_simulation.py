"""Speed of the flight simulation beside JSBSim's F450, of the linearisation, of compilation from nothing, and of the command.

``pytest benchmarks/test_simulation.py -s``. CPU seconds of one thread, so that other work on the machine matters little; the
command's answer is wall time. Nothing here passes or fails by a time: the table at the end is the result.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import levelone
from levelone.dynamics import linearize, simulate
from levelone.handling.manoeuvres import step
from levelone.vehicle import VehicleBatch, nominal_value, vary

RUNS, SECONDS, DT = 500, 10.0, 0.004
STEP = step("V_lon", 1.0, trim_speed=5.0, duration=SECONDS)
OMEGA = np.geomspace(0.3, 40.0, 200)
TARGETS = ("M", "I_y", "K_T", "T_u", "C_Lalpha", "C_malpha", "C_mq")
JSBSIM_STEPS = 10_000
COLD = """
import time
import numpy as np
start = time.process_time()
import levelone
vehicle = levelone.load_vehicle("reference-evtol")
imported = time.process_time()
history = levelone.simulate(vehicle, levelone.step("V_lon", 1.0, trim_speed=5.0))
levelone.linearize(vehicle, 5.0).frequency_response("V_lon", "q", np.array([1.0]))
print(imported - start, time.process_time() - imported)
"""

pytestmark = pytest.mark.benchmark(timer=time.process_time)


@pytest.fixture(scope="module")
def table() -> Iterator[dict[str, str]]:
    """What each measurement adds a line to; printed when all are done."""
    lines: dict[str, str] = {}
    yield lines
    print("\n" + "\n".join(f"{name:62s} {value}" for name, value in lines.items()))


def family(tau_d: float) -> VehicleBatch:
    """500 vehicles within 20 % of the reference."""
    craft = levelone.load_vehicle("reference-evtol")
    nominal = np.array([nominal_value(craft, target, 5.0) for target in TARGETS])
    points = nominal * (1.0 + 0.2 * np.random.default_rng(1).uniform(-1.0, 1.0, (RUNS, len(TARGETS))))
    return vary(craft, (*TARGETS, "tau_d"), np.column_stack([points, np.full(RUNS, tau_d)]), 5.0)


def least(benchmark: Any, work: Any, rounds: int) -> float:
    """Least CPU seconds of several calls, after one that compiles."""
    benchmark.pedantic(work, rounds=rounds, iterations=1, warmup_rounds=1)
    return float(benchmark.stats.stats.min)


@pytest.mark.parametrize("tau_d", [0.0, 0.0137])
def test_step_responses(benchmark: Any, table: dict[str, str], tau_d: float) -> None:
    """With a delay that is not a multiple of the period, each period is integrated in two parts."""
    batch = family(tau_d)
    kept = ("q", "theta", "V_lon")
    seconds = least(benchmark, lambda: simulate(batch, STEP, channels=kept, threads=1), 5)
    steps = RUNS * SECONDS / DT * (2 if tau_d else 1)
    speed = f"{steps / seconds / 1e6:.2f} million RK4 steps/s"
    table[f"{RUNS} step responses of {SECONDS:.0f} s, tau_d = {tau_d:g} s"] = f"{seconds:.2f} CPU-s, {speed}"
    assert (simulate(batch, STEP, channels=kept).status == 0).all()


def hovering_f450() -> Any:
    """JSBSim's quadrotor in flight under its own stability augmentation."""
    jsbsim = pytest.importorskip("jsbsim")
    peer = jsbsim.FGFDMExec(None)
    peer.set_debug_level(0)
    peer.set_dt(DT)
    assert peer.load_model("F450")
    assert peer.load_ic("initGrnd", True)
    assert peer.run_ic()
    peer["fcs/ScasEngage"] = 1.0
    peer["fcs/throttle-cmd-norm"] = 0.5
    for _ in range(500):
        peer.run()
    peer["fcs/throttle-cmd-norm"] = 0.49
    return peer


def test_steps_beside_jsbsim(table: dict[str, str]) -> None:
    """Both on one core, by turns in slices of about a tenth of a second; JSBSim driven from Python as its users do."""
    peer, batch = hovering_f450(), family(0.0).select(slice(0, 64))
    simulate(batch, STEP, channels=("q",), threads=1)
    theirs, ours = [], []
    for _ in range(15):
        start = time.process_time()
        for _ in range(JSBSIM_STEPS):
            peer.run()
        between = time.process_time()
        simulate(batch, STEP, channels=("q",), threads=1)
        theirs.append(JSBSIM_STEPS / (between - start))
        ours.append(len(batch) * SECONDS / DT / (time.process_time() - between))
    assert np.isfinite(peer["position/h-agl-ft"])
    for name, pick in (("best", max), ("median", np.median)):
        a, b = float(pick(ours)), float(pick(theirs))
        speeds = f"{a / 1e6:.2f} million; JSBSim {b / 1e3:.0f} thousand"
        table[f"steps a second, {name} of 15 turns"] = f"{speeds}: {a / b:.0f} times (wanted: 20)"


def test_linear_responses(benchmark: Any, table: dict[str, str]) -> None:
    batch = family(0.0137)

    def work() -> None:
        linearize(batch, 5.0, threads=1).frequency_response("V_lon", "q", OMEGA, threads=1)

    table[f"{RUNS} linearisations and responses at {len(OMEGA)} frequencies"] = f"{least(benchmark, work, 3):.2f} CPU-s"


def clean_environment(cache: str) -> dict[str, str]:
    """The environment with an empty place for machine code."""
    kept = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    return {**kept, "XDG_CACHE_HOME": cache}


def test_cold_compilation(table: dict[str, str], tmp_path: Any) -> None:
    fresh = clean_environment(str(tmp_path))
    done = subprocess.run([sys.executable, "-c", COLD], env=fresh, capture_output=True, text=True, check=True)
    imported, compiled = map(float, done.stdout.split())
    table["import and vehicle file"] = f"{imported:.2f} CPU-s"
    table["compilation of trim, flight and linearisation from nothing"] = f"{compiled:.1f} CPU-s"


def test_help_answers(table: dict[str, str]) -> None:
    pytest.importorskip("levelone.cli")
    seconds = []
    for _ in range(5):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-m", "levelone.cli", "--help"], capture_output=True, check=True)
        seconds.append(time.perf_counter() - start)
    table["levelone --help"] = f"{min(seconds):.2f} s wall"
