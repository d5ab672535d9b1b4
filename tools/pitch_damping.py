"""Print every table of docs/theory/pitch-damping.md, in Markdown.

    python tools/pitch_damping.py [table ...]

All tables if none is named (two minutes).
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import astuple, fields

import numpy as np

import pitch_hypotheses as hypotheses
from levelone.aerodynamics import scan
from levelone.aerodynamics.geometry import FloatArray, Geometry, refined
from levelone.aerodynamics.scan import Case
from levelone.aerodynamics.slender_body import BodyDerivatives, contributions
from pitch_hypotheses import ARM, ARMS, BOTH, FINER, FULL, FUSELAGE, LIFTING_SURFACE, OSCILLATION, WING, Arms, K, with_arm
from unshifted_rings import pitch as unshifted_pitch

SLOW_TO_FAST = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)


def row(label: str, *cells: str) -> str:
    return f"| {' | '.join((label, *cells))} |"


def table(head: Iterable[str], rows: Iterable[str]) -> list[str]:
    names = list(head)
    return [row(*names), "|" + "---|" * len(names), *rows]


def bar(value: float, error: float) -> str:
    """A value with its error bar, rounded up to 0.001 at least."""
    digits = 3 if error < 0.02 else 2
    return f"{value:.{digits}f} ± {max(np.ceil(error * 10**digits), 1.0) / 10**digits:.{digits}f}"


def plain(values: FloatArray) -> list[str]:
    return [f"{each:.2f}" for each in np.ravel(values)]


def percent(residual: float) -> str:
    return f"{100.0 * residual:+.0f} %" if abs(residual) >= 0.095 else f"{100.0 * residual:+.1f} %"


def steady() -> list[str]:
    cases = [Case("wing", WING), Case("wing and tail, as printed", BOTH), Case("with incidence and end plates", FULL)]
    found = scan.quasi_steady(cases)
    rows = [row(label, *map(bar, found.value[i], found.error[i])) for i, label in enumerate(found.labels)]
    return table(
        ("Geometry", *scan.QUASI_STEADY), [*rows, row("study, lifting-surface code", *(f"{x:g}" for x in LIFTING_SURFACE))]
    )


def frequency() -> list[str]:
    found = scan.oscillations([Case("", BOTH)], SLOW_TO_FAST)
    rows = [
        row(f"{k:g}", *(bar(found.quadrature[0, m, j, c], found.error[0, m, j, c]) for m in range(3) for c in range(2)))
        for j, k in enumerate(found.k)
    ]
    return table(("k", *(f"{motion} {name}" for motion in found.motions for name in scan.COEFFICIENTS)), rows)


def shares() -> list[str]:
    """Wing by itself, and what the tail adds."""
    found = scan.oscillations([Case("", WING), Case("", BOTH)], SLOW_TO_FAST)
    wing, tail = found.quadrature[0], found.quadrature[1] - found.quadrature[0]
    chosen = [("pitch", 0, 0), ("pitch", 0, 1), ("heave", 1, 1), ("rate", 2, 1)]
    names = [f"{part}, {motion} {scan.COEFFICIENTS[c]}" for part in ("wing", "tail") for motion, _, c in chosen]
    rows = [row(f"{k:g}", *(f"{part[m, j, c]:.2f}" for part in (wing, tail) for _, m, c in chosen)) for j, k in enumerate(found.k)]
    return table(("k", *names), rows)


def arm(arms: Arms) -> list[str]:
    value = arms.found.at("pitch")
    rows = [row(f"{a:.2f}", *plain(value[i])) for i, a in enumerate(ARMS)]
    rows += [row("study", *(f"{x:g}" for x in OSCILLATION.ravel()))]
    rows += [row("arm that gives it", *(f"{arms.fitted(j, c):.2f} m" for j in range(2) for c in range(2)))]
    return table(("Arm, m", *(f"{name}, k = {k:g}" for k in K for name in scan.COEFFICIENTS)), rows)


def judged(found: dict[str, FloatArray], target: FloatArray, names: Iterable[str]) -> list[str]:
    rows = []
    for label, value in found.items():
        residual = value / target - 1.0
        rows.append(
            row(
                label,
                *(f"{v:.2f} ({percent(r)})" for v, r in zip(value.flat, residual.flat, strict=True)),
                hypotheses.verdict(residual),
            )
        )
    return table(("Hypothesis", *names, ""), [*rows, row("study", *(f"{x:g}" for x in target.flat), "")])


def oscillation(arms: Arms) -> list[str]:
    found = hypotheses.readings() | hypotheses.parts() | hypotheses.places(arms)
    return judged(found, OSCILLATION, (f"{name}, k = {k:g}" for k in K for name in scan.COEFFICIENTS))


def lifting_surface() -> list[str]:
    return judged(hypotheses.lifting_surface(), LIFTING_SURFACE, scan.QUASI_STEADY)


def variants() -> list[Case]:
    turned = [(f"wing at {a:g} deg", "wing", a) for a in (2.0, 4.5)] + [(f"tail at {a:g} deg", "tail", a) for a in (-2.0, 2.0)]
    return [
        Case("as printed", BOTH),
        *(Case(f"arm {a:+.0%}", with_arm(ARM * (1.0 + a))) for a in (-0.05, 0.05)),
        *(Case(f"CG {s:+.2f} c", scan.about(BOTH, s)) for s in (-0.05, 0.05, 0.1)),
        *(Case(label, scan.changed(BOTH, name, incidence=np.radians(angle))) for label, name, angle in turned),
        *(Case(f"tail {z:+.1f} m up", scan.moved(BOTH, ["tail"], up=z)) for z in (0.1, 0.2, 0.3)),
        *(
            Case(f"end plates {h:.1f} m high", refined(scan.with_end_plates(BOTH, "tail", h), FINER, FINER))
            for h in (0.1, 0.2, 0.3)
        ),
    ]


def sensitivity() -> list[str]:
    cases = variants()
    slow, fast = scan.quasi_steady(cases), scan.oscillations(cases, [0.1], ("pitch",))
    rows = [
        row(case.label, *map(bar, slow.value[i], slow.error[i]), *map(bar, fast.at("pitch")[i, 0], fast.error[i, 0, 0]))
        for i, case in enumerate(cases)
    ]
    return table(("Variant", *scan.QUASI_STEADY, "pitch C_L, k = 0.1", "pitch C_m, k = 0.1"), rows)


def scheme() -> list[str]:
    """Wing alone by an ordinary scheme."""

    def grid(chordwise: int) -> Geometry:
        return scan.with_uniform_strips(WING, {"wing": (chordwise, 10)})

    rows = [
        row(f"rings on the panels' edges, {n} x 20", *plain(np.array([unshifted_pitch(grid(n), k) for k in K]))) for n in (4, 8, 16)
    ]
    rows += [row("converged", *plain(scan.oscillations([Case("", WING)], K, ("pitch",)).at("pitch")[0]))]
    return table(("Wing alone", *(f"{name}, k = {k:g}" for k in K for name in scan.COEFFICIENTS)), rows)


def fuselage() -> list[str]:
    found = contributions(FUSELAGE, BOTH)
    return table((field.name for field in fields(BodyDerivatives)), [row(*(f"{x:.3f}" for x in astuple(found)))])


def main() -> None:
    plain_tables = (steady, frequency, shares, lifting_surface, sensitivity, scheme, fuselage)
    of_arms = (arm, oscillation)
    names = [make.__name__ for make in (*plain_tables, *of_arms)]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", nargs="*", help=", ".join(names))
    chosen = parser.parse_args().table or names
    if unknown := set(chosen) - set(names):
        parser.error(f"no table {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    found = {make.__name__: make for make in plain_tables if make.__name__ in chosen}
    tables = {name: make() for name, make in found.items()}
    if any(make.__name__ in chosen for make in of_arms):
        arms = Arms()
        tables |= {make.__name__: make(arms) for make in of_arms if make.__name__ in chosen}
    for name, lines in tables.items():
        print(f"<!-- {name} -->", *lines, "", sep="\n")


if __name__ == "__main__":
    main()
