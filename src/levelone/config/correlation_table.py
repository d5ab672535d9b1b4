"""Correlated factors of a study: pairs and their rank correlations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from levelone.config.factor_table import Inputs
from levelone.config.study_schema import CorrelationTable, CouplingTable, in_words
from levelone.errors import InputError, unknown_name
from levelone.uncertainty import FactorSpace


def correlated(inputs: Inputs, tables: Sequence[CorrelationTable], coupling: CouplingTable | None) -> Inputs:
    """The study's inputs with the correlations that its file gives; as they are where it gives none.

    Raises
    ------
    InputError
        A name that is unknown or stands twice in a pair, a pair given twice, correlations that no set of variables can have,
        neither source nor assumed; a study that also screens pitch-roll coupling, since a Morris design moves factors one by one.
    """
    if not tables:
        return inputs
    if coupling is not None:
        raise InputError("coupling", 'is a Morris screening, which correlated factors have none of: without = ["coupling"]')
    names = inputs.space.names
    rank = np.eye(len(names))
    for i, table in enumerate(tables, 1):
        path = f"correlation.{i}"
        table.require(path)
        for name in table.factors:
            if name not in names:
                raise unknown_name(f"{path}.factors", name, names)
        first, second = (names.index(name) for name in table.factors)
        if first == second:
            raise InputError(f"{path}.factors", f"names {table.factors[0]!r} twice: two factors are needed")
        if rank[first, second] != 0.0:
            raise InputError(f"{path}.factors", f"{' and '.join(table.factors)} are correlated above already")
        rank[first, second] = rank[second, first] = table.rank
    return replace(inputs, space=FactorSpace(inputs.space.factors, rank))


def described(tables: Sequence[CorrelationTable]) -> tuple[tuple[str, str, float, str], ...]:
    """Both factors of each pair, their rank correlation, and its origin in words."""
    return tuple((*table.factors, table.rank, in_words(table)) for table in tables)
