"""Numbers as a vehicle file writes them: value, unit, and where they come from or why they are assumed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, model_validator

from levelone.config.schema import Strict, Text, shown
from levelone.config.units import to_si
from levelone.errors import InputError

Shape = tuple[int | None, ...]
Sign = Literal["any", "not negative", "positive"]


class Origin(Strict):
    """Where a number or a whole section comes from: ``source`` or ``assumed``, not both."""

    needed: ClassVar[bool] = False
    """Whether one of them must be given, here or by the section above."""

    source: Text | None = None
    assumed: Text | None = None

    def require(self, path: str, inherited: bool = False) -> None:
        """InputError where there is neither, and the section above says nothing."""
        if self.source is None and self.assumed is None and not inherited:
            raise InputError(path, "neither source nor assumed: say where it comes from, or why it is assumed")

    @model_validator(mode="after")
    def _one(self) -> Origin:
        if self.source is not None and self.assumed is not None:
            raise InputError("source", "either source or assumed, not both")
        return self


class Quantity(Origin):
    """A number, or an array of numbers with one unit and one origin; see :func:`si` for what ``value`` becomes."""

    needed: ClassVar[bool] = True

    value: Any
    unit: str


def si(unit: str, *shapes: Shape, sign: Sign = "any") -> AfterValidator:
    """Annotation of a :class:`Quantity` that is kept in ``unit`` and has one of the shapes (None: any length).

    ``Annotated[Quantity, si("m", (None, 3))]`` takes one point or more; without a shape, a single number.
    """

    def convert(given: Quantity) -> Quantity:
        numbers = _numbers(given.value, shapes or ((),))
        if (sign == "positive" and numbers.min() <= 0.0) or (sign == "not negative" and numbers.min() < 0.0):
            raise InputError("", f"must {'be positive' if sign == 'positive' else 'not be negative'}, got {shown(given.value)}")
        return given.model_copy(update={"value": to_si(numbers, given.unit, unit, ""), "unit": unit})

    return AfterValidator(convert)


def plain(unit: str) -> BeforeValidator:
    """Annotation of a float that a file gives as a number in ``unit``, or as a table of value and unit."""

    def convert(given: Any) -> float:
        if not isinstance(given, dict):
            return float(_numbers(given, ((),)))
        if set(given) != {"value", "unit"} or not isinstance(given["unit"], str):
            raise InputError("", f"is {shown(given)}; must be a number in {unit}, or a table of value and unit")
        return float(to_si(_numbers(given["value"], ((),)), given["unit"], unit, ""))

    return BeforeValidator(convert)


def _numbers(value: Any, shapes: tuple[Shape, ...]) -> NDArray[np.float64]:
    numbers = np.array(np.nan)
    if _only_numbers(value):
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except ValueError:  # rows of different length
            raise InputError("", f"is {shown(value)}; rows differ in length, must be {_words(shapes)}") from None
    if not np.isfinite(numbers).all():
        raise InputError("", f"is {shown(value)}; must be {_words(shapes)}, finite")
    if not any(_fits(numbers.shape, shape) for shape in shapes):
        raise InputError("", f"is {shown(value)}; must be {_words(shapes)}")
    return numbers


def _only_numbers(value: Any) -> bool:
    if isinstance(value, list):
        return len(value) > 0 and all(_only_numbers(each) for each in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def _fits(given: tuple[int, ...], wanted: Shape) -> bool:
    return len(given) == len(wanted) and all(w is None or g == w for g, w in zip(given, wanted, strict=True))


def _words(shapes: tuple[Shape, ...]) -> str:
    return " or ".join(_shape_in_words(shape) for shape in shapes)


def _shape_in_words(shape: Shape) -> str:
    if not shape:
        return "a number"
    if len(shape) == 1:
        return "a list of numbers" if shape[0] is None else f"a list of {shape[0]} numbers"
    return f"a list of rows of {shape[1]} numbers"


def origins(table: Strict, path: str = "", inherited: bool = False) -> Iterator[tuple[str, str]]:
    """(path, why) of everything marked as assumed in a section and below it; for a section, its own path.

    A number without an origin rests on that of its section.

    Raises
    ------
    InputError
        A number without an origin in a section without one.
    """
    if isinstance(table, Origin):
        if table.needed:
            table.require(path, inherited)
        inherited = inherited or table.source is not None or table.assumed is not None
        if table.assumed is not None:
            yield path, table.assumed
    for name in type(table).model_fields:
        part = getattr(table, name)
        if isinstance(part, Strict):
            yield from origins(part, f"{path}.{name}" if path else name, inherited)
