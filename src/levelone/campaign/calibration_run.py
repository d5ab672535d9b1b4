"""``levelone calibrate``: fits from all starts, what they identify, trade-offs and checks, and the files that a run leaves."""

from __future__ import annotations

import datetime
import json
import platform
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray

from levelone._version import __version__
from levelone.campaign.calibration import CLOSENESS, STEP, UNDEFINED, Fit, differentiate, fit, fly, rounded, starts_of
from levelone.campaign.calibration_checks import checks_json
from levelone.campaign.calibration_summary import describe_calibration, fit_json, identifiability_json, reached_json
from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.store import prepare_folder, write_json
from levelone.campaign.study import Progress, build_model
from levelone.campaign.tradeoff import Case, cases_of, tradeoff_json
from levelone.config.calibration_file import Calibration
from levelone.config.changes import changed
from levelone.config.files import read_toml
from levelone.config.vehicle_file import load_vehicle, vehicle_hash
from levelone.config.vehicle_writer import copy_path, write_vehicle
from levelone.dynamics.simulate import threads_of
from levelone.vehicle import Vehicle, batch_of
from levelone.vehicle.tables import FloatArray

SCHEMA = 1
Result = TypeVar("Result")


def run_calibration(
    calibration: Calibration,
    out: Path,
    *,
    threads: int | None = None,
    progress: Progress = lambda stage, done, total: None,
) -> Path:
    """Calibrate a vehicle and write the folder of results.

    The fit from the priors is the calibrated vehicle, ``DIR/VEHICLE.toml``. Its numbers are rounded first, and what is reported is
    what the rounded numbers give. The same file gives the same numbers, whatever the number of threads and whatever values the
    vehicle's file has for the parameters.

    Parameters
    ----------
    calibration
        From :func:`levelone.config.calibration_file.load_calibration`.
    out
        Folder of results; created if need be. Not the folder of the vehicle's file.
    threads
        Worker threads, each with a fit of its own.
    progress
        Called with the stage's name, what is done and what there is to do.

    Returns
    -------
    Path
        Of calibration.json. Beside it lie the vehicle with its rotor tables, and ``calibrations.json``: name and changes of the
        perturbed fits, for experiments.

    Raises
    ------
    InputError
        For a folder that cannot be written.
    """
    began, folder = time.perf_counter(), prepare_folder(Path(out))
    copy_path(calibration.study.vehicle_path, folder)
    model = _model(calibration)
    model.nominal()  # compiled, and with the choice of peaks that others are compared with, before threads share it
    solved = _solve(calibration, model, threads_of(threads), progress)
    path, vehicle = _write(calibration, folder, solved.values[0])
    of_file = model.assess_batch(batch_of(vehicle)).responses
    runs, points = _described(calibration, model, solved, reached_json(calibration, of_file)[0])
    accepted = np.array([run["accepted"] for run in runs[1:]], dtype=bool)
    slopes = differentiate(model, calibration, solved.values[0], range(len(calibration.parameters)))
    perturbed = [{"name": run["name"], "changes": run["changes"]} for run in runs[1:] if run["accepted"]]
    results = {
        "schema": SCHEMA,
        "calibration": describe_calibration(calibration),
        "vehicle": {"name": vehicle.name, "file": path.name},
        "starts": runs,
        "calibrations": perturbed,
        "identifiability": identifiability_json(calibration, slopes.jacobian, slopes.value, *solved.perturbed(accepted)),
        "tradeoff": tradeoff_json(calibration, solved.cases, points),
        "checks": checks_json(calibration, replace(model, vehicle=vehicle, threads=threads), runs[0]["changes"], progress),
        "method": {"penalty_of_undefined": UNDEFINED, "difference_step": STEP, "closeness": CLOSENESS},
        "provenance": _provenance(calibration, time.perf_counter() - began),
    }
    (folder / "calibrations.json").write_text(json.dumps(perturbed, indent=1) + "\n", encoding="utf-8")
    write_json(folder / "calibration.json", results)
    return folder / "calibration.json"


@dataclass(frozen=True, eq=False)
class _Solved:
    """Fits from all starts with their rounded values [starts, parameters], and those of the trade-off's cases."""

    fits: list[Fit]
    values: FloatArray
    cases: list[Case]
    traded: list[Fit]
    traded_values: FloatArray

    def perturbed(self, accepted: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """[n, parameters] before and after, of the accepted fits from perturbed starts."""
        return np.array([each.start for each in self.fits])[1:][accepted], self.values[1:][accepted]


def _solve(calibration: Calibration, model: BuiltinModel, workers: int, progress: Progress) -> _Solved:
    fits = _all([partial(fit, model, calibration, start, start) for start in starts_of(calibration)], "fits", workers, progress)
    cases = cases_of(calibration, fits[0].values)
    traded = _all([partial(case.solved, model) for case in cases], "trade-off", workers, progress) if cases else []
    return _Solved(
        fits=fits,
        values=np.array([rounded(calibration, each.values) for each in fits]),
        cases=cases,
        traded=traded,
        traded_values=np.array([case.rounded(each) for case, each in zip(cases, traded, strict=True)]),
    )


def _described(
    calibration: Calibration, model: BuiltinModel, solved: _Solved, first: dict[str, Any]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Every fit and what its rounded values give; ``first`` is what the written vehicle gives."""
    flown = np.vstack([solved.values, *([solved.traded_values] if solved.cases else [])])
    reached = reached_json(calibration, fly(model, calibration, flown))
    reached[0] = first
    n = len(solved.fits)
    runs = [
        {"name": _name(i)} | fit_json(calibration, each, row) | found
        for i, (each, row, found) in enumerate(zip(solved.fits, solved.values, reached[:n], strict=True))
    ]
    points = [
        fit_json(case.calibration, each, row) | found
        for case, each, row, found in zip(solved.cases, solved.traded, solved.traded_values, reached[n:], strict=True)
    ]
    return runs, points


def _name(i: int) -> str:
    return "priors" if i == 0 else f"start {i}"


def _model(calibration: Calibration) -> BuiltinModel:
    """The study's manoeuvres, about the vehicle with the parameters at their priors; one thread, since fits share the others."""
    prior = calibration.changes([each.prior for each in calibration.parameters])
    return replace(build_model(calibration.study, threads=1), vehicle=load_vehicle(calibration.study.vehicle_path, prior))


def _all(tasks: Sequence[Callable[[], Result]], stage: str, workers: int, progress: Progress) -> list[Result]:
    """Results of independent tasks in their order, each in a thread of its own."""
    progress(stage, 0, len(tasks))
    pool = ThreadPoolExecutor(workers)
    try:
        results = []
        for done, future in enumerate([pool.submit(task) for task in tasks], 1):
            results.append(future.result())
            progress(stage, done, len(tasks))
        return results
    finally:
        pool.shutdown(cancel_futures=True)


def _write(calibration: Calibration, folder: Path, values: FloatArray) -> tuple[Path, Vehicle]:
    """The calibrated vehicle's file: the fitted numbers, each with the reason for its prior and the file that fitted it."""
    content = read_toml(calibration.study.vehicle_path)
    changes: dict[str, float] = {}
    why: dict[str, str] = {}
    for each, value in zip(calibration.parameters, values, strict=True):
        if each.role != "fit" and changed(content, {each.path: float(value)}) == content:
            continue  # stands there already
        word = "calibrated" if each.role == "fit" else "held"
        changes |= dict.fromkeys((each.path, *each.ties), float(value))
        why |= dict.fromkeys((each.path, *each.ties), f"{each.assumed}; {word} by {calibration.path.name}")
    return write_vehicle(calibration.study.vehicle_path, folder, changes, why)


def _provenance(calibration: Calibration, seconds: float) -> dict[str, Any]:
    return {
        "levelone": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "platform": platform.platform(),
        "calibration_sha256": calibration.hash,
        "study_sha256": calibration.study.hash,
        "vehicle_sha256": vehicle_hash(calibration.study.vehicle_path),
        "wall_s": round(seconds, 3),
        "finished": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }
