"""Where the evaluations of a campaign run: in this process, in processes of this machine, on a cluster.

An executor gives answers in the order in which they come. Which executor, how many workers and how points are grouped changes no
answer: points are evaluated one by one or in groups by the same model, and the caller puts them in order.
"""

from __future__ import annotations

import sys
from collections.abc import Generator
from typing import TYPE_CHECKING, Protocol

from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, Model
    from levelone.config.campaign_table import CampaignOptions


class Executor(Protocol):
    """Anything that carries points to a model and brings back its answers; to be closed when a campaign has no more to run."""

    @property
    def retries(self) -> int:
        """How often a failed evaluation is tried again; :func:`levelone.campaign.evaluate.evaluate` does it."""

    def run(self, model: Model, points: FloatArray) -> Generator[tuple[IntArray, Evaluations], None, None]:
        """Indices into ``points`` [n, factors] and the answers there, each index once, in the order in which they are finished.

        A pair may be empty: it says that nothing more is at hand, and that what was given should be committed now. To close the
        generator stops every evaluation.

        Raises
        ------
        LeveloneError
            The model cannot be opened, or the workers cannot be reached.
        """

    def close(self) -> None:
        """End what is kept from one :meth:`run` to the next, as a cluster that was started."""


def executor_of(options: CampaignOptions) -> Executor:
    """The executor that a study file or the command line names.

    Raises
    ------
    InputError
        It does not exist on this platform, or needs a package that is not installed.
    """
    if options.executor != "batch" and sys.platform == "win32":
        raise InputError("executor", f"{options.executor!r} needs Linux or macOS; on Windows use its Subsystem for Linux")
    if options.executor == "batch":
        from levelone.campaign.executors.batch import BatchExecutor

        return BatchExecutor(**_chunk(options), retries=options.retries)
    if options.executor == "processes":
        from levelone.campaign.executors.processes import ProcessExecutor

        return ProcessExecutor(options.workers, options.time_limit, options.retries, **_chunk(options))
    from levelone.campaign.executors.dask_cluster import DaskExecutor

    where = options.cluster or options.executor.removeprefix("dask://")
    return DaskExecutor(where, options.time_limit, options.retries, **_chunk(options))


def _chunk(options: CampaignOptions) -> dict[str, int]:
    return {} if options.chunk is None else {"chunk": options.chunk}
