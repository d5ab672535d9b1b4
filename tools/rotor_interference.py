"""Print every table of docs/theory/rotor-wakes.md, in Markdown.

    python tools/rotor_interference.py [propeller | hover | streams | convergence | wing ...]

All tables if none is named (a quarter of an hour on two cores, nearly all of it for the wing).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from levelone.aerodynamics.actuator_disc import Disc, Vector
from levelone.aerodynamics.disc_rings import theory
from levelone.aerodynamics.disc_wake import Marching, Settled, settle
from levelone.aerodynamics.rotor_theory import propeller as describe
from levelone.aerodynamics.rotor_theory import slipstream
from levelone.campaign.rotor_interference import CLEAN, RADIUS, WITH_WAKES, interference, summary

#: unit radius, density and hover velocity
UNIT = Disc((0.0, 0.0, 0.0), 1.0, 2.0 * math.pi)
MARCH = Marching(step=0.1, points=48, core=0.15, free=24, far=24, settle=48, window=48)
#: largest chord of the assumed blade of the rotor table, 0.26 R; K_T and speed of rotation: study, Table 2
CHORD, K_T, RPM, DENSITY = 0.26 * RADIUS, 6.96e-8, 11_100.0, 1.225
STREAMS: tuple[Vector, ...] = (
    (0.0, 0.0, 0.0), (0.0, 0.0, -0.5), (0.0, 0.0, -1.0), (0.0, 0.0, -2.0), (0.42, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0),
    (4.0, 0.0, 0.0),
)  # fmt: skip


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    names = list(head)
    return [f"| {' | '.join(each)} |" for each in (names, ["---"] * len(names), *(list(row) for row in rows))]


def run(stream: Vector, how: Marching) -> tuple[float, Settled]:
    """Inflow of the unit disc over that of momentum theory, and everything else."""
    found = settle([UNIT], stream, 1.0, how, np.array([[0.0, 0.0, -2.2]]))
    return float(found.inflow.mean()) / theory(UNIT, np.array(stream), 1.0).induced, found


def at_core(how: Marching, core: float) -> Marching:
    """The same march with another core, as many particles to a core."""
    return replace(how, core=core, points=round(how.points * how.core / core))


def propeller() -> list[str]:
    found = describe(RADIUS, RPM, K_T, CHORD, DENSITY)
    flow = slipstream(found.thrust, DENSITY, RADIUS)
    slow = slipstream(found.thrust, DENSITY, RADIUS, edgewise=5.0)
    rows = (
        ("thrust", f"{found.thrust:.2f} N, eight: {8.0 * found.thrust:.1f} N"),
        ("tip speed", f"{found.tip_speed:.1f} m/s"),
        ("C_T = T/(rho n^2 D^4)", f"{found.thrust_coefficient:.3f}"),
        ("Reynolds number at 3/4 R", f"{found.reynolds:.2g}"),
        ("v_h", f"{flow.hover:.2f} m/s"),
        ("mass flux in hover", f"{flow.mass_flux:.3f} kg/s"),
        ("at 5 m/s edgewise: v_i", f"{slow.induced:.2f} m/s"),
        ("skew angle of the slipstream", f"{math.degrees(slow.skew):.1f} deg"),
    )
    return table(("Quantity", "Value"), rows)


def hover() -> list[str]:
    rows, before = [], None
    for core in (0.3, 0.2, 0.15, 0.1):
        ratio, found = run((0.0, 0.0, 0.0), at_core(MARCH, core))
        limit = "" if before is None else f"{ratio + (ratio - before[1]) * core / (before[0] - core):.3f}"
        axis = -float(found.velocity.mean(axis=0)[0, 2])
        rows.append((f"{core:g}", f"{ratio:.4f}", limit, f"{found.radius.min():.3f}", f"{axis:.3f}", found.words))
        before = core, ratio
    return table(
        ("Core / R", "inflow / v_h", "limit by this row and the one above", "narrowest radius / R", "axis, 2.2 R down / v_h", ""),
        rows,
    )


def streams() -> list[str]:
    rows = []
    for stream in STREAMS:
        (coarse, _), (fine, found) = (run(stream, at_core(MARCH, core)) for core in (0.3, 0.15))
        wanted, drift = theory(UNIT, np.array(stream), 1.0), found.drift[0]
        rows.append(
            (
                f"{stream[0]:g}", f"{abs(stream[2]):g}", f"{wanted.induced:.3f}", f"{fine:.3f}", f"{2.0 * fine - coarse:.3f}",
                f"{math.degrees(math.atan2(drift[0], -drift[2])):.0f}", f"{math.degrees(wanted.skew):.0f}", found.words,
            )
        )  # fmt: skip
    head = (
        "edgewise / v_h",
        "climb / v_h",
        "theory v_i / v_h",
        "inflow / theory, core 0.15 R",
        "without core",
        "skew, deg",
        "theory",
        "",
    )
    return table(head, rows)


def convergence() -> list[str]:
    variants = {
        "as above": MARCH,
        "half the time step": replace(MARCH, step=0.05, free=48, far=48, settle=96, window=96),
        "1.5 times the particles": replace(MARCH, points=72),
        "free wake of 16 rings": replace(MARCH, free=16, settle=40),
        "free wake of 32 rings": replace(MARCH, free=32, settle=56),
        "carried wake of 48 rings": replace(MARCH, far=48, settle=72),
        "window of 96 steps": replace(MARCH, window=96),
    }
    rows = []
    for label, how in variants.items():
        found = [run(stream, how)[0] for stream in ((0.0, 0.0, 0.0), (0.42, 0.0, 0.0), (1.0, 0.0, 0.0))]
        rows.append((label, *(f"{each:.4f}" for each in found)))
    return table(("Inflow / theory", "hover", "edgewise 0.42 v_h", "edgewise v_h"), rows)


def wing() -> list[str]:
    found = interference()
    rows = [
        (
            each.case.group, each.case.label, f"{each.thrust:.2f}", f"{100.0 * each.camber:.2f}", f"{each.clean[0]:.3f}",
            f"{each.loss:+.3f} ± {each.unsteady[0]:.3f}", f"{each.surfaces[0, 0]:+.3f}", f"{each.surfaces[1, 0]:+.3f}",
            f"{each.change[4]:+.3f}", each.words,
        )
        for each in found
    ]  # fmt: skip
    head = ("Group", "Case", "T, N", "camber, %", "clean C_L0", "change of C_L0", "wing", "tail", "change of C_m0", "")
    got = summary(found)
    return [
        *table(head, rows),
        "",
        f"Base {got.base:+.3f} ± {got.numerical:.3f} (numerical); {got.lowest:+.3f} to {got.highest:+.3f} over the assumptions; "
        f"the study's predecessor: {WITH_WAKES - CLEAN:+.3f}. Failed: {got.failed}, not settled: {got.unsettled}, of {len(found)}.",
    ]


TABLES = {"propeller": propeller, "hover": hover, "streams": streams, "convergence": convergence, "wing": wing}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", nargs="*", choices=[*TABLES, []], help="tables to print; all if none is named")
    for name in parser.parse_args().table or TABLES:
        print(f"\n### {name}\n")
        print("\n".join(TABLES[name]()), flush=True)


if __name__ == "__main__":
    main()
