"""The way to a Dask cluster: a scheduler that runs somewhere, one on this machine, one whose workers a queueing system starts."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levelone.campaign.executors.scratch import scratch
from levelone.config.campaign_table import Cluster
from levelone.errors import InputError

if TYPE_CHECKING:
    from distributed import Client, SpecCluster
    from distributed.security import Security

LOOPBACK = "127.0.0.1"
#: for the answer of a scheduler, and for its return once it was lost
PATIENCE = "10s"
#: s, for a queueing system to take all jobs
SUBMITTING = 120.0
#: the pages that a scheduler would serve are left out, and what is left of its server can be reached from this machine only
NO_PAGES = {"dashboard": False, "dashboard_address": f"{LOOPBACK}:0"}


@contextmanager
def connected(where: str | Cluster) -> Iterator[Client]:
    """A client of the scheduler at HOST:PORT, or of a cluster that ends with the block.

    Whoever reaches a Dask scheduler can have anything executed by its workers. The clusters started here are closed to others by
    certificates made for the occasion; a scheduler of one's own, named by its address, is used as it is.

    Raises
    ------
    InputError
        Nothing answers at the address; a package is missing; the queueing system refuses.
    """
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise _missing("distributed") from None
    with ExitStack() as stack:
        stack.enter_context(dask.config.set({"distributed.scheduler.http.routes": []}))
        if isinstance(where, Cluster):
            cluster = stack.enter_context(_local(where) if where.kind == "local" else _slurm(where))
            yield stack.enter_context(Client(cluster, set_as_default=False))
            return
        try:
            client = Client(f"tcp://{where}", timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError) as error:
            raise InputError("executor", f"no Dask scheduler answers at dask://{where}: {error}") from None
        yield stack.enter_context(client)


def _local(cluster: Cluster) -> SpecCluster:
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=cluster.workers,
        threads_per_worker=cluster.cores,
        memory_limit=cluster.memory,
        host=LOOPBACK,
        protocol="tls://",
        security=_certificates(),
        dashboard_address=None,
        scheduler_kwargs=NO_PAGES,
        silence_logs=logging.ERROR,
    )


@contextmanager
def _slurm(cluster: Cluster) -> Iterator[SpecCluster]:
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise _missing("dask_jobqueue") from None
    options: dict[str, Any] = {"queue": cluster.queue, "account": cluster.account, "walltime": cluster.walltime}
    # the jobs read the certificates: in a folder that all machines of a cluster see
    with (
        scratch(Path.cwd(), f".levelone-{socket.gethostname()}@") as folder,
        SLURMCluster(
            n_workers=cluster.workers,
            cores=cluster.cores,
            processes=1,
            memory=cluster.memory,
            protocol="tls://",
            security=_written(_certificates(), folder),
            shared_temp_directory=str(folder),
            scheduler_options=NO_PAGES,
            **{name: value for name, value in options.items() if value is not None},
        ) as made,
    ):
        _submitted(made, cluster.workers)
        yield made


def _submitted(cluster: Any, jobs: int) -> None:
    """Wait until every job has been offered to the queueing system; InputError where it took none."""
    from distributed.core import Status

    until = time.monotonic() + SUBMITTING
    while len(cluster.workers) < jobs and time.monotonic() < until:
        time.sleep(0.05)
    # a job that is refused has no number; what the system said about it, the cluster has written to the log
    for name in [name for name, job in cluster.workers.items() if not job.job_id]:
        # the cluster counts it among those to be cancelled at its end, and stumbles over it
        cluster.workers.pop(name).status = Status.failed
    if not cluster.workers:
        raise InputError("cluster", f"the queueing system took none of {jobs} jobs; the log says why")


def _written(security: Security, folder: Path) -> Security:
    """The same certificates in files: their names, not they, appear in the script of a job."""
    from distributed.security import Security

    files: dict[str, str] = {}
    for name in ("ca_file", *(f"{role}_{what}" for role in ("scheduler", "worker", "client") for what in ("cert", "key"))):
        path = folder / f"{name}.pem"
        path.touch(mode=0o600)
        path.write_text(getattr(security, f"tls_{name}"), encoding="ascii")
        files[f"tls_{name}"] = str(path)
    return Security(require_encryption=True, **files)


def _certificates() -> Security:
    from distributed.security import Security

    try:
        return Security.temporary()
    except ImportError:
        raise _missing("cryptography") from None


def _missing(package: str) -> InputError:
    return InputError("executor", f"a Dask cluster needs the package {package}: pip install levelone[cluster]")
