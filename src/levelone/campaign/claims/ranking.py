"""Places of inputs in a ranking by an index. A tie shares the better place; an index of 0 has no place at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from levelone.campaign.claims.decision import Condition, Decision, decided


def place(values: Mapping[str, float], name: str) -> int:
    """1 for the largest; inputs of equal index share the better place."""
    return 1 + sum(other > values[name] for other in values.values())


def leading(
    values: Mapping[str, float], names: Sequence[str], index: str, *, first: int, least: int | None = None, last: int | None = None
) -> Decision:
    """At least ``least`` of the names (all where None) in top(``first``), and all in top(``last``) where given."""
    short = sorted(_shortfall(values, name, first) for name in names)
    wanted = short[: len(names) if least is None else least]
    conditions = [Condition(not any(wanted), sum(wanted))]
    if last is not None:
        missed = [_shortfall(values, name, last) for name in names]
        conditions.append(Condition(not any(missed), sum(missed)))
    places = {name: place(values, name) for name in names}
    here = f"places in {index}: " + ", ".join(f"{name} {places[name]}" for name in names)
    return decided(here, {f"place_{name}": float(places[name]) for name in names}, *conditions)


def top(values: Mapping[str, float], n: int) -> list[str]:
    """The inputs in top(n), largest first."""
    return sorted((name for name in values if _shortfall(values, name, n) == 0.0), key=lambda name: -values[name])


def _shortfall(values: Mapping[str, float], name: str, n: int) -> float:
    """Part of the n-th largest index that a name lacks; 0 inside top(n), 1 for an index of 0."""
    if values[name] <= 0.0:
        return 1.0
    return 0.0 if place(values, name) <= n else 1.0 - values[name] / sorted(values.values(), reverse=True)[n - 1]
