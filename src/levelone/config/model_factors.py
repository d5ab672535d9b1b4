"""Factors of a model of one's own: they set the model's own names, in the model's own units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from levelone.config.factor_table import Inputs, check_targets, distribution_of
from levelone.config.study_schema import FactorTable, in_words
from levelone.errors import InputError
from levelone.uncertainty import Factor, FactorSpace


def own_inputs(tables: Sequence[FactorTable], taken: Mapping[str, str]) -> Inputs:
    """The factors of a model of one's own.

    Parameters
    ----------
    tables
        Entries of the study file. ``unit`` is the model's own, in free words, and every number is in it: nothing is converted.
    taken
        Names in the model that the study file sets otherwise, and where it does.

    Raises
    ------
    InputError
        A range that is reversed or has no width, a distribution without ends, a name or target given twice, a target that is also
        set as a fixed number or moved by the command, neither source nor assumed.
    """
    paths = [f"factor.{table.name}" for table in tables]
    factors = []
    for path, table in zip(paths, tables, strict=True):
        table.require(path)
        target = table.target if table.target is not None else table.name
        if target in taken:
            raise InputError(path, f"sets {target!r} as {taken[target]} does; each name may be set once")
        if not table.unit.strip():
            raise InputError(f"{path}.unit", 'is empty; name the unit of the model, "1" for a pure number')
        made = distribution_of(table, table.value, 1.0, path)
        factors.append(Factor(table.name, made, target=target, unit=table.unit, source=in_words(table)))
    check_targets(paths, factors)
    space = FactorSpace(factors)
    space.require_bounded("a Morris design")
    nominal = np.array([table.value for table in tables], dtype=np.float64)
    nominal.setflags(write=False)
    return Inputs(space, tuple(factor.target for factor in factors), nominal)
