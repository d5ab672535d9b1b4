"""A study as Dakota's input files: screening, Latin hypercube, decomposition on a surrogate and on the model itself."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from levelone.campaign.dakota.variables import check_expressible, check_label, quoted, variables_block
from levelone.campaign.models.builtin import RESPONSES
from levelone.config.study_file import Study
from levelone.errors import InputError, unknown_name
from levelone.uncertainty import FactorSpace, Uniform, stage_seed

#: evaluations of one call of the driver: a call costs a second or two before the first of them
BATCH, DIRECT_BATCH = 512, 4096
DIRECT_POINTS = 1024


@dataclass(frozen=True)
class Plan:
    """What the input files say.

    Parameters
    ----------
    space
        The factors.
    responses
        Names, in the order that Dakota is to have.
    driver
        The analysis driver, to which Dakota appends the names of a parameters and a results file.
    seed
        From which the seed of each file is derived.
    trajectories, levels
        Of psuade_moat.
    samples
        Of the Latin hypercube.
    surrogate_points, direct_points
        Base points N of the decompositions, each of N (k + 2) evaluations: of the surrogate, and of the model.
    title
        For the comments.
    """

    space: FactorSpace
    responses: tuple[str, ...]
    driver: str
    seed: int
    trajectories: int
    levels: int
    samples: int
    surrogate_points: int
    direct_points: int
    title: str


@dataclass(frozen=True)
class Exported:
    """Input files that were written, and (name, why) of those that were not."""

    written: tuple[Path, ...]
    left_out: tuple[tuple[str, str], ...]


def plan_of(
    study: Study, *, responses: Sequence[str] = (), seed: int | None = None, direct_points: int = DIRECT_POINTS
) -> Plan:  # fmt: skip
    """What Dakota is to do with a study; all responses unless some are named.

    Raises
    ------
    InputError
        An unknown response or one that is named twice, a study file whose path cannot stand between quotes.
    """
    names = tuple(responses) or tuple(RESPONSES)
    for name in names:
        if name not in RESPONSES:
            raise unknown_name("--response", name, RESPONSES)
    if len(set(names)) != len(names):
        raise InputError("--response", f"a name is given twice in {', '.join(names)}")
    if direct_points < 2:
        raise InputError("--direct", f"{direct_points} base points; at least 2 are needed")
    path = str(study.path.resolve())
    if any(letter in path for letter in "'\"\n"):
        raise InputError("dakota", f"the path {path} holds a quote, and cannot stand in an input file")
    method = study.method
    return Plan(
        space=study.space, responses=names, driver=f"levelone dakota drive '{path}'", seed=study.seed if seed is None else seed,
        trajectories=method.trajectories, levels=method.levels, samples=method.samples, surrogate_points=method.base_points,
        direct_points=direct_points, title=study.title,
    )  # fmt: skip


def export_plan(plan: Plan, folder: Path) -> Exported:
    """Write the input files of a plan into a folder that exists.

    Raises
    ------
    InputError
        What Dakota cannot express in any of the files, or a file that cannot be written.
    """
    check_expressible(plan.space)
    for name in plan.responses:
        check_label(name, f"response {name}")
    moves, decomposes = _why_no_screening(plan.space), _why_no_decomposition(plan.space)
    files = {
        "morris": (_morris(plan), moves), "lhs": (_lhs(plan), ""),
        "surrogate": (_surrogate(plan), decomposes), "direct": (_direct(plan), decomposes),
    }  # fmt: skip
    written = []
    for name, (text, why) in files.items():
        if not why:
            written.append(folder / f"{name}.in")
            _write(written[-1], text)
    return Exported(tuple(written), tuple((f"{name}.in", why) for name, (_, why) in files.items() if why))


def _write(path: Path, text: str) -> None:
    part = path.with_suffix(".part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        raise InputError("--out", f"cannot write {path}: {error.strerror}") from None


def _why_no_screening(space: FactorSpace) -> str:
    """psuade_moat steps over the range of a variable and ignores its distribution; here a step is one of probability."""
    if space.correlated:
        return "psuade_moat moves one variable and holds the others, and the factors are correlated"
    other = [factor.name for factor in space.factors if not isinstance(factor.distribution, Uniform)]
    if other:
        return f"psuade_moat steps evenly over a range and ignores distributions, and these are not uniform: {', '.join(other)}"
    return ""


def _why_no_decomposition(space: FactorSpace) -> str:
    return "shares of variance by pick-freeze need independent factors, and these are correlated" if space.correlated else ""


def _seed(plan: Plan, name: str) -> int:
    """Dakota takes positive seeds of 31 bits."""
    return stage_seed(plan.seed, f"dakota {name}") % (2**31 - 1) + 1


def _comments(plan: Plan, name: str, what: Sequence[str], more: Sequence[str] = ()) -> str:
    lines = [
        plan.title, "", *what, "",
        f"Run it in this folder:  dakota -input {name}.in > {name}.log",
        *more,
    ]  # fmt: skip
    return "\n".join(f"# {line}".rstrip() for line in lines)


def _restart(name: str) -> list[str]:
    return [
        f"Interrupted? Go on:     dakota -input {name}.in -read_restart {name}.rst > {name}.log",
        "  (batches that came back are kept; the one that was under way is run anew)",
        f"Then:                   levelone dakota import {name}.dat --study STUDY.toml",
    ]


def _environment(name: str, tabular: bool = True) -> str:
    lines = [
        "environment",
        "  output_precision = 16             # the default of ten digits would round the points",
        f"  output_file = '{name}.out'",
        f"  write_restart = '{name}.rst'",
    ]
    lines += ["  tabular_data", f"    tabular_data_file = '{name}.dat'"] if tabular else []
    lines += ["  results_output", "    hdf5", f"    results_output_file = '{name}'"]
    # what a surrogate predicts are no runs, and some ten megabytes of them
    return "\n".join(lines if tabular else [*lines, "      model_selection none"])


def _interface(plan: Plan, name: str, batch: int) -> str:
    return "\n".join(
        [
            "interface",
            f'  analysis_drivers = "{plan.driver}"',
            "    fork",
            f"      parameters_file = '{name}-parameters.in'",
            f"      results_file = '{name}-results.out'",
            "  # One call of the driver flies a whole batch, since each call takes a second or two to start. A run that fails",
            "  # comes back as nan: a failure string among the results of a batch makes Dakota 6.24 abort, and a value in place",
            "  # of a failed run would be taken for a response.",
            f"  batch size = {batch}",
        ]
    )


def _responses(plan: Plan) -> str:
    lines = ["responses", f"  response_functions = {len(plan.responses)}", f"    descriptors {quoted(plan.responses)}"]
    return "\n".join([*lines, "  no_gradients", "  no_hessians"])


def _assembled(*parts: str) -> str:
    return "\n\n".join(parts) + "\n"


def _morris(plan: Plan) -> str:
    runs = plan.trajectories * (len(plan.space) + 1)
    what = [
        f"Screening: elementary effects on {plan.trajectories} trajectories over {plan.levels} levels.",
        "A single nan makes every index of its response nan in what Dakota prints; levelone leaves out its trajectory.",
    ]
    method = "\n".join(
        [
            "method", "  id_method = 'morris'", "  psuade_moat",
            f"    samples = {runs}                 # trajectories times (factors + 1)",
            f"    partitions = {plan.levels - 1}                # levels - 1",
            f"    seed = {_seed(plan, 'morris')}",
        ]
    )  # fmt: skip
    parts = _environment("morris"), method, variables_block(plan.space), _interface(plan, "morris", BATCH), _responses(plan)
    return _assembled(_comments(plan, "morris", what, _restart("morris")), *parts)


def _lhs(plan: Plan) -> str:
    what = [f"Monte Carlo: a Latin hypercube of {plan.samples} points. surrogate.in builds on its results."]
    method = _sampling("lhs", "lhs", plan.samples, _seed(plan, "lhs"))
    parts = _environment("lhs"), method, variables_block(plan.space), _interface(plan, "lhs", BATCH), _responses(plan)
    return _assembled(_comments(plan, "lhs", what, _restart("lhs")), *parts)


def _sampling(name: str, kind: str, samples: int, seed: int, *more: str) -> str:
    lines = ["method", f"  id_method = '{name}'", "  sampling", f"    sample_type {kind}", f"    samples = {samples}"]
    return "\n".join([*lines, f"    seed = {seed}", *more])


def _surrogate(plan: Plan) -> str:
    what = [
        "Sobol indices on surfpack's Gaussian process, built from the runs of lhs.in: run that first.",
        "Dakota leaves out runs that are nan without a word, and gives no interval: neither of the sampling nor of the surrogate.",
    ]
    method = _sampling(
        "surrogate",
        "lhs",
        plan.surrogate_points,
        _seed(plan, "surrogate"),
        "    variance_based_decomp",
        "  model_pointer = 'SURROGATE'",
    )
    model = "\n".join(
        ["model", "  id_model = 'SURROGATE'", "  surrogate global", "    gaussian_process surfpack",
         "    import_build_points_file = 'lhs.dat' annotated"]
    )  # fmt: skip
    parts = _environment("surrogate", tabular=False), method, model, variables_block(plan.space), _responses(plan)
    more = ["Then:                   levelone dakota import surrogate.h5 --study STUDY.toml"]
    return _assembled(_comments(plan, "surrogate", what, more), *parts)


def _direct(plan: Plan) -> str:
    k = len(plan.space)
    what = [
        f"Sobol indices of the model itself: {plan.direct_points} base points, {plan.direct_points * (k + 2)} runs.",
        "A single nan makes Dakota 6.24 print no indices at all; levelone leaves out its base point.",
    ]
    method = _sampling("direct", "lhs", plan.direct_points, _seed(plan, "direct"), "    variance_based_decomp")
    parts = _environment("direct"), method, variables_block(plan.space), _interface(plan, "direct", DIRECT_BATCH), _responses(plan)
    return _assembled(_comments(plan, "direct", what, _restart("direct")), *parts)
