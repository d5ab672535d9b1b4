"""Direct decomposition: Sobol indices of the flight simulation model itself, without a surrogate between.

The pick-freeze design is several independent scramblings of one Sobol set. Each is flown, kept on disk and reduced to its responses
before the next; the spread between them gives the intervals, and more of them can be added until these are as narrow as asked.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from levelone._version import __version__
from levelone.campaign.analysis import in_words
from levelone.campaign.brief import READ, BriefModel, brief_model, check_against_whole
from levelone.campaign.describe import provenance_hashes
from levelone.campaign.sampling import Progress
from levelone.campaign.scrambling_store import ScramblingStore, key_of
from levelone.campaign.store import prepare_folder, write_json
from levelone.campaign.study import build_model
from levelone.config.study_file import Study
from levelone.errors import InputError
from levelone.uncertainty import Design, Responses, SobolIndices, sobol, sobol_design, stage_seed
from levelone.uncertainty.failures import EstimateStatus, Policy
from levelone.uncertainty.sobol import widest

SCHEMA = 1
FILE, FOLDER = "direct.json", "direct"
#: scramblings that are added at a time until the intervals are narrow enough
ADDED = 4
#: how often in a row they must be: met once, narrow intervals are more often the lucky ones
CONFIRMED = 2
#: runs of the first scrambling that are compared with whole records
CHECKED = 64
STAGE = "direct decomposition"


@dataclass(frozen=True)
class Plan:
    """What is asked of a direct decomposition.

    Parameters
    ----------
    base_points
        In all scramblings together; a power of two for each of them.
    scramblings
        Independent ones, at least four.
    second_order
        Whether pairs of factors are wanted, for nearly twice the runs.
    groups
        Factors that are moved together, by the name of the group.
    until_width
        Width of the widest interval of S1 and ST below which no scramblings are added; None where none are to be.
    most_base_points
        Where adding ends all the same.
    """

    base_points: int = 4096
    scramblings: int = 8
    second_order: bool = False
    groups: Mapping[str, Sequence[str]] | None = None
    until_width: float | None = None
    most_base_points: int = 65536

    def __post_init__(self) -> None:
        if self.scramblings < 4:
            raise InputError("--scramblings", f"is {self.scramblings}; an interval needs 4 or more")
        each = self.base_points // self.scramblings
        if each * self.scramblings != self.base_points or each < 2 or each & (each - 1):
            near = self.scramblings * 2 ** max(1, round(np.log2(max(each, 2))))
            raise InputError(
                "--base-points", f"is {self.base_points}; needs a power of two for each of {self.scramblings} scramblings: {near}"
            )
        if self.until_width is not None and not 0.0 < self.until_width < np.inf:
            raise InputError("--until-width", f"is {self.until_width}; a positive width is needed")

    @property
    def each(self) -> int:
        """Base points of one scrambling."""
        return self.base_points // self.scramblings

    def design(self, study: Study, seed: int, scramblings: int) -> Design:
        """The points of so many scramblings; those of fewer are their beginning."""
        options: dict[str, Any] = {"second_order": self.second_order, "scramblings": scramblings, "groups": self.groups}
        return sobol_design(study.space, self.each, stage_seed(seed, "direct"), **options)


@dataclass(frozen=True)
class Found:
    """Design, responses [runs] and indices by response."""

    design: Design
    responses: Responses
    indices: Mapping[str, SobolIndices]

    @property
    def width(self) -> float:
        """The widest interval of S1 and ST of the responses that have intervals; NaN where none has."""
        return max((widest(each) for each in self.indices.values() if each.status is EstimateStatus.OK), default=float("nan"))


def decompose_study(
    study: Study,
    out: Path,
    plan: Plan,
    *,
    seed: int | None = None,
    threads: int | None = None,
    progress: Progress = lambda stage, done, total: None,
) -> Path:
    """Decompose a study's model directly, and write ``direct.json``; runs that ``out`` holds already are not flown again.

    Parameters
    ----------
    study
        From :func:`levelone.config.study_file.load_study`.
    out
        Results folder; created if need be.
    plan
        Size and stopping rule.
    seed
        In place of the study file's.
    threads
        Worker threads; no influence on the results.
    progress
        Called with the stage's name, what is done and what there is to do.

    Raises
    ------
    InputError
        A folder that cannot be written, an unknown factor in a group, correlated factors, and what would fail in every run.
    """
    seed = study.seed if seed is None else seed
    begin = time.perf_counter(), time.process_time()
    first = plan.design(study, seed, plan.scramblings)
    folder = prepare_folder(Path(out))
    (folder / FOLDER).mkdir(exist_ok=True)
    model = brief_model(build_model(study, threads))
    store = ScramblingStore(folder / FOLDER, _key(study, seed, plan))
    found = _analysed(study, first, _responses(model, store, first, threads, progress))
    met = 0
    while plan.until_width is not None and np.isfinite(found.width):  # what is undefined, more runs do not mend
        met = met + 1 if found.width <= plan.until_width else 0
        if met == CONFIRMED or found.design.base + ADDED * plan.each > plan.most_base_points:
            break
        more = plan.design(study, seed, found.design.scramblings + ADDED)
        found = _analysed(study, more, _responses(model, store, more, threads, progress))
    checked = check_against_whole(model, found.design.points[:: max(1, found.design.runs // CHECKED)][:CHECKED])
    spent = {"wall_s": time.perf_counter() - begin[0], "cpu_s": time.process_time() - begin[1], "peak_memory_gib": _peak_memory()}
    write_json(folder / FILE, _described(study, plan, seed, found) | {"against_whole_records": checked, "cost": spent})
    return folder / FILE


def _key(study: Study, seed: int, plan: Plan) -> str:
    groups = {name: list(members) for name, members in (plan.groups or {}).items()}
    content = {"levelone": __version__, "seed": seed, "each": plan.each, "second_order": plan.second_order, "groups": groups}
    return key_of(content | provenance_hashes(study) | {"responses": list(READ)})


def _responses(model: BriefModel, store: ScramblingStore, design: Design, threads: int | None, progress: Progress) -> Responses:
    """Responses at every point, those of the store where it has them."""
    size, done, parts = design.runs // design.scramblings, 0, []

    def step(runs: int) -> None:
        nonlocal done
        done += runs
        progress(STAGE, done, design.runs)

    progress(STAGE, 0, design.runs)
    for index in range(design.scramblings):
        held = store.read(index)
        if held is None:
            held = model.evaluate(design.points[index * size : (index + 1) * size], threads, step)
            store.write(index, held)
        else:
            step(len(held))
        parts.append(held)
    values, status = (np.vstack([getattr(part, what) for part in parts]) for what in ("values", "status"))
    return Responses(values, status, parts[0].names, parts[0].units)


def _analysed(study: Study, design: Design, responses: Responses) -> Found:
    policy: Policy = "drop" if study.policy == "refuse" else study.policy  # what is refused is withheld where it is written
    indices = {name: sobol(design, responses.column(name), policy=policy) for name in responses.names}
    return Found(design, responses, indices)


def _described(study: Study, plan: Plan, seed: int, found: Found) -> dict[str, Any]:
    design = found.design
    return {
        "schema": SCHEMA,
        "levelone": __version__,
        "study": study.name,
        "seed": seed,
        **provenance_hashes(study),
        "base_points": design.base,
        "scramblings": design.scramblings,
        "runs": design.runs,
        "second_order": plan.second_order,
        "groups": {name: list(members) for name, members in (plan.groups or {}).items()},
        "until_width": float("nan") if plan.until_width is None else plan.until_width,
        "widest": found.width,
        "names": list(next(iter(found.indices.values())).names),
        "responses": {name: _response(study, found, name) for name in found.indices},
    }


def _response(study: Study, found: Found, name: str) -> dict[str, Any]:
    x, r = found.indices[name], found.responses
    failures, _ = in_words(r.counts(name))
    refused = study.policy == "refuse" and bool(failures)
    status = f"refused: {sum(failures.values())} runs failed and the study's policy is 'refuse'" if refused else x.status.text
    nan = np.nan if refused else 0.0
    fields = {"S1": x.S1, "ST": x.ST, "S1_ci": x.S1_ci, "ST_ci": x.ST_ci}
    rows = {each: {key: (values[j] + nan).tolist() for key, values in fields.items()} for j, each in enumerate(x.names)}
    out: dict[str, Any] = {
        "unit": r.units[r.index(name)], "variance": x.variance, "base_points_used": x.used, "failed": x.failed,
        "failures": failures, "status": status, "doubt": status if refused else x.doubt, "sobol": rows,
    }  # fmt: skip
    if x.bounding is not None:
        out["bounded"] = {
            end: dict(zip(x.names, each.ST.tolist(), strict=True)) for end, each in zip(("low", "high"), x.bounding, strict=True)
        }
    if found.design.second_order:
        out["S2"] = _pairs(x, nan)
    return out


def _pairs(x: SobolIndices, nan: float) -> list[dict[str, Any]]:
    """Second-order indices, largest first."""
    pairs = [(i, j) for i in range(len(x.names)) for j in range(i + 1, len(x.names))]
    rows = [{"pair": [x.names[i], x.names[j]], "S2": x.S2[i, j] + nan, "S2_ci": (x.S2_ci[i, j] + nan).tolist()} for i, j in pairs]
    return sorted(rows, key=lambda row: -np.nan_to_num(row["S2"], nan=-np.inf))


def _peak_memory() -> float:
    """Largest memory of the process so far, GiB."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30
