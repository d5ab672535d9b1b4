"""How the evaluations of a campaign are carried out: nothing here changes a result."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from levelone.errors import InputError, unknown_name

EXECUTORS = ("batch", "processes", "cluster")
DASK = "dask://HOST:PORT"
_ADDRESS = re.compile(r"dask://(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?):(?P<port>[0-9]{1,5})")
_WALLTIME = re.compile(r"(?:[0-9]{1,3}-)?[0-9]{1,3}:[0-5][0-9]:[0-5][0-9]")
_MEMORY = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,3})? ?(?:[kMGT]i?B)")
# a name goes into a script of the queue, one line each: nothing that a shell or a second line could read
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.@+-]{0,63}")
MOST_WORKERS = 10_000
MOST_RETRIES = 100
MOST_IN_CHUNK = 100_000


@dataclass(frozen=True)
class Cluster:
    """A cluster that is started for the campaign.

    Parameters
    ----------
    kind
        "slurm", or "local": worker processes of Dask on this machine.
    workers
        Number of jobs.
    cores
        Of each job.
    memory
        Of each job, as text: "4 GB".
    walltime
        Of each job, HH:MM:SS or D-HH:MM:SS; for "slurm" only.
    queue, account
        Of the queueing system; None for its default.

    Raises
    ------
    InputError
        A value out of range, or one that belongs to "slurm" only; a name that holds more than letters, digits and ``_.@+-``.
    """

    kind: str
    workers: int
    cores: int = 1
    memory: str = "2 GB"
    walltime: str | None = None
    queue: str | None = None
    account: str | None = None

    def __post_init__(self) -> None:
        if self.kind not in ("slurm", "local"):
            raise unknown_name("kind", self.kind, ("slurm", "local"))
        _within("workers", self.workers, 1, MOST_WORKERS)
        _within("cores", self.cores, 1, 4096)
        for field, pattern, like in (
            ("memory", _MEMORY, "'4 GB'"),
            ("walltime", _WALLTIME, "'01:00:00'"),
            ("queue", _NAME, "letters, digits and _.@+-"),
            ("account", _NAME, "letters, digits and _.@+-"),
        ):
            given = getattr(self, field)
            if given is not None and not pattern.fullmatch(given):
                raise InputError(field, f"is {given!r}; write it like {like}" if "'" in like else f"is {given!r}; may hold {like}")
        if self.kind == "local":
            for field in ("walltime", "queue", "account"):
                if getattr(self, field) is not None:
                    raise InputError(field, 'has no place here: kind = "local" has no queue')


@dataclass(frozen=True)
class CampaignOptions:
    """Where evaluations run, and what is kept of them.

    Parameters
    ----------
    executor
        "batch" (in this process), "processes", "dask://HOST:PORT" or "cluster".
    workers
        Of "processes" only; None for one on each core.
    time_limit
        s, one evaluation; infinite where there is none. "batch" cannot end a run and takes none.
    retries
        How often an evaluation is tried again of which the model left a response unanswered, whatever the reason.
    chunk
        Evaluations that travel together; None for the executor's own choice.
    histories
        Whether records are kept beside the responses.
    cluster
        With executor "cluster" only.

    Raises
    ------
    InputError
        A value out of range, an executor that there is not, a time limit that nothing could enforce.
    """

    executor: str = "batch"
    workers: int | None = None
    time_limit: float = math.inf
    retries: int = 0
    chunk: int | None = None
    histories: bool = False
    cluster: Cluster | None = None

    def __post_init__(self) -> None:
        check_executor(self.executor, "executor")
        if self.workers is not None:
            _within("workers", self.workers, 1, MOST_WORKERS)
            if self.executor != "processes":
                raise InputError("workers", f'has no place here: it goes with executor = "processes", not with {self.executor!r}')
        if not self.time_limit > 0.0:
            raise InputError("time_limit", f"is {self.time_limit:g} s, must be positive")
        if self.executor == "batch" and math.isfinite(self.time_limit):
            raise InputError("time_limit", 'has no place here: executor = "batch" cannot end a run; use "processes"')
        _within("retries", self.retries, 0, MOST_RETRIES)
        if self.chunk is not None:
            _within("chunk", self.chunk, 1, MOST_IN_CHUNK)
        if self.executor == "cluster" and self.cluster is None:
            raise InputError("cluster", 'missing: executor = "cluster" needs it')
        if self.executor != "cluster" and self.cluster is not None:
            raise InputError("cluster", 'has no place here: it goes with executor = "cluster"')


def check_executor(text: str, field: str) -> None:
    """InputError unless the text names an executor; an address needs a host and a port from 1 to 65535."""
    if text in EXECUTORS:
        return
    if not text.startswith("dask://"):
        raise unknown_name(field, text, [*EXECUTORS, DASK])
    found = _ADDRESS.fullmatch(text)
    if found is None:
        raise InputError(field, f"{text!r} is not an address; write it like dask://127.0.0.1:8786")
    if not 1 <= int(found["port"]) <= 65535:
        raise InputError(field, f"{text!r} has port {found['port']}; must lie between 1 and 65535")


def _within(field: str, value: int, least: int, most: int) -> None:
    if not least <= value <= most:
        raise InputError(field, f"is {value}, must lie between {least} and {most}")
