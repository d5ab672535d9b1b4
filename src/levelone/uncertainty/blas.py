"""One BLAS thread at a time for dense linear algebra, so that digits do not depend on the machine's core count.

Threads of the BLAS library do not pay on matrices of a few hundred rows (they cost CPU time and change the last
digits); work is spread over responses instead.
"""

from __future__ import annotations

import threading
from types import TracebackType

from threadpoolctl import threadpool_limits


class OneBlasThread:
    """Context in which BLAS runs on one thread; re-entrant, and shared by all threads that are inside.

    The limit of a BLAS library belongs to the process, and only the thread that set it can take it back. So the first
    thread to enter sets it, and on leaving waits for the others inside before it restores the former limit.
    """

    _condition = threading.Condition()
    _local = threading.local()
    _inside = 0
    _owner: int | None = None
    _limits: threadpool_limits | None = None

    def __enter__(self) -> OneBlasThread:
        cls = OneBlasThread
        cls._local.depth = getattr(cls._local, "depth", 0) + 1
        if cls._local.depth == 1:
            with cls._condition:
                if cls._owner is None:
                    cls._owner = threading.get_ident()
                    cls._limits = threadpool_limits(limits=1, user_api="blas").__enter__()
                cls._inside += 1
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        cls = OneBlasThread
        cls._local.depth -= 1
        if cls._local.depth:
            return
        with cls._condition:
            cls._inside -= 1
            cls._condition.notify_all()
            if cls._owner == threading.get_ident() and cls._limits is not None:
                cls._condition.wait_for(lambda: cls._inside == 0)
                # not restore_original_limits(): that keeps this thread the only one which can ever set a limit again
                cls._limits.__exit__(None, None, None)
                cls._owner = cls._limits = None
