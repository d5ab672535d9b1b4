"""Groups of factors that a design moves together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from levelone.errors import InputError
from levelone.uncertainty.factors import FactorSpace

Groups = tuple[tuple[str, tuple[str, ...]], ...]
"""Name and factors of each group; empty where every factor moves alone."""


def resolve_groups(space: FactorSpace, groups: Mapping[str, Sequence[str]] | None) -> Groups:
    """Groups that hold every factor exactly once.

    Parameters
    ----------
    space
        Factors.
    groups
        Factors by name of the group; None for no groups at all.

    Returns
    -------
    The groups in the order given, then each factor that is in none as a group of one under its own name; empty where
    ``groups`` is None.

    Raises
    ------
    InputError
        No group, an empty or unnamed group, an unknown factor, a factor given twice, a group with the name of a factor
        that stands alone.
    """
    if groups is None:
        return ()
    if not groups:
        raise InputError("groups", "at least one group is needed; without groups leave the argument out")
    named = []
    for name, members in groups.items():
        if not isinstance(name, str) or not name.strip():
            raise InputError("groups", f"{name!r} is not a name")
        if isinstance(members, str) or not members:
            raise InputError(f"group {name}", f"{members!r}; a list of names of factors is needed")
        named.append((name, tuple(space.names[space.index(member)] for member in members)))
    count = Counter(member for _, members in named for member in members)
    twice = [member for member, times in count.items() if times > 1]
    if twice:
        raise InputError("groups", f"factor given twice: {', '.join(twice)}")
    alone = [(name, (name,)) for name in space.names if name not in count]
    for name, _ in alone:
        if name in groups:
            raise InputError(f"group {name}", "a factor that is in no group has this name; give the group another")
    return (*named, *alone)


def group_columns(space: FactorSpace, groups: Groups) -> tuple[tuple[int, ...], ...]:
    """Columns of the factors of each group; of each factor alone where there are no groups."""
    if not groups:
        return tuple((j,) for j in range(len(space)))
    return tuple(tuple(space.index(name) for name in members) for _, members in groups)


def group_names(groups: Groups) -> tuple[str, ...]:
    """Names of the groups."""
    return tuple(name for name, _ in groups)
