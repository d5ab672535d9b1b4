"""The analysis driver: evaluations that Dakota asks for, flown in one batch."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from levelone.campaign.dakota.parameters import Evaluation, read_parameters
from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.models.protocol import Model
from levelone.errors import InputError, closest, unknown_name
from levelone.uncertainty import FactorSpace
from levelone.uncertainty.distributions import FloatArray

VALUE = 1


def drive(space: FactorSpace, model: BuiltinModel | Model, parameters: Path, results: Path) -> tuple[int, int]:
    """Answer a parameters file: read it, fly what it asks for, write the results file in one move.

    Parameters
    ----------
    space
        Factors of the study, whose names are the descriptors of the variables.
    model
        What is evaluated; its names are the descriptors of the responses.
    parameters, results
        The files that Dakota names; a batch is one file.

    Returns
    -------
    Evaluations, and how many of the values asked for were undefined and written as ``nan``.

    Raises
    ------
    InputError
        Nothing is then written, so that Dakota stops: a file that is no parameters file, a variable that the study does not have or
        lacks, an unknown response, a request for derivatives, a results file that cannot be written.
    """
    asked = read_parameters(parameters)
    points = points_of(asked, space)
    for each in asked:
        _check_responses(each, model.names)
    values = model.evaluate(points).values
    text, undefined = answer(asked, values, model.names)
    part = results.with_name(results.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, results)
    except OSError as error:
        raise InputError("results file", f"cannot write {results}: {error.strerror}") from None
    return len(asked), undefined


def points_of(asked: Sequence[Evaluation], space: FactorSpace) -> FloatArray:
    """[evaluations, factors] physical values, whatever order Dakota keeps its variables in.

    Raises
    ------
    InputError
        A variable that is no factor, or a factor that is missing.
    """
    for each in asked:
        for name in each.variables:
            if name not in space.names:
                raise unknown_name(f"variable of evaluation {each.identifier}", name, space.names)
        for name in space.names:
            if name not in each.variables:
                raise InputError(
                    f"evaluation {each.identifier}", f"lacks the factor {name}; all of {', '.join(space.names)} are needed"
                )
    return np.array([[each.variables[name] for name in space.names] for each in asked])


def _check_responses(each: Evaluation, names: Sequence[str]) -> None:
    for name, active in each.active.items():
        if name not in names:
            raise InputError(f"response of evaluation {each.identifier}", f"unknown name {name!r}; {closest(name, names)}")
        if active & ~VALUE:
            raise InputError(
                f"response {name} of evaluation {each.identifier}",
                f"active set {active} asks for a gradient or a Hessian, and only values are computed: write no_gradients and "
                "no_hessians, or numerical_gradients, in the responses section",
            )


def answer(asked: Sequence[Evaluation], values: FloatArray, names: Sequence[str]) -> tuple[str, int]:
    """Text of the results file, and how many of the values asked for are undefined.

    Values stand in the order of the parameters file's descriptors, to the last bit; an undefined one is ``nan``, since a string
    that marks a failure makes Dakota 6.24 abort among the results of a batch. A response that is not asked for is left out.
    """
    column = {name: j for j, name in enumerate(names)}
    blocks, undefined = [], 0
    for each, row in zip(asked, values.tolist(), strict=True):
        wanted = [(name, row[column[name]]) for name, active in each.active.items() if active & VALUE]
        undefined += sum(value != value for _, value in wanted)
        blocks.append("".join(f"{value!r} {name}\n" for name, value in wanted))
    return "#\n".join(blocks), undefined
