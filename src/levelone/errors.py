"""What can go wrong through the user's input, said in one line.

A run that fails inside a batch is not an error but data: see the status tables of :mod:`levelone.dynamics` and
:mod:`levelone.handling`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class LeveloneError(Exception):
    """Base of every error that the package raises on purpose; its text is meant for the user.

    ``exit_code`` is that of the command which it ends: 2, or 130 where the user interrupted it.
    """

    exit_code = 2


class InputError(LeveloneError, ValueError):
    """A value given by the user is missing, unknown, out of range or of the wrong unit.

    Parameters
    ----------
    field
        Path of the value, as the user wrote it (``"factor.M.range"``).
    problem
        What is wrong, with the value and what is allowed.
    """

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(f"{field}: {problem}")
        self.field = field
        self.problem = problem


def closest(name: str, allowed: Iterable[str]) -> str:
    """Text that names the closest valid name and lists what is allowed, for the end of an error's line."""
    names = sorted(allowed)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}? " if near else ""
    shown = ", ".join(names[:40]) + (", ..." if len(names) > 40 else "")
    return f"{hint}allowed: {shown}"


def unknown_name(field: str, name: str, allowed: Iterable[str]) -> InputError:
    """The error for a name that is not among those allowed."""
    return InputError(field, f"unknown name {name!r}; {closest(name, allowed)}")
