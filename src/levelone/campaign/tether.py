"""A process that ends with the one that started it, together with every process of its group.

A pipe leads from the starter to the process: nobody writes to it, and the starter alone holds its writing end. When the starter
ends, by whatever signal, the kernel closes that end; the reading end has been told to answer with SIGKILL to the group of the
process (fcntl(2): F_SETOWN with a group, F_SETSIG, O_ASYNC). No thread of the process has to run for this, so that a model that
hangs in compiled code goes as well, and unlike PR_SET_PDEATHSIG it does not depend on the thread that started the process.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal


class Tether:
    """The pipe between a starter and one process of its own session or group.

    Start the process with ``pass_fds=(tether.far,)`` and ``start_new_session=True``, then :meth:`tie` it. Where the kernel has
    no F_SETSIG (it is Linux's), the pipe is all there is: the process can wait for its end.
    """

    def __init__(self) -> None:
        self.far, self._near = os.pipe()

    def tie(self, group: int) -> None:
        """SIGKILL to ``group`` once the starter ends or lets go; the reading end is the group's from now on."""
        if hasattr(fcntl, "F_SETSIG"):
            fcntl.fcntl(self.far, fcntl.F_SETSIG, signal.SIGKILL)
            fcntl.fcntl(self.far, fcntl.F_SETOWN, -group)
            fcntl.fcntl(self.far, fcntl.F_SETFL, fcntl.fcntl(self.far, fcntl.F_GETFL) | os.O_ASYNC)
        self._close_far()

    def release(self) -> None:
        """Let go: what is left of the group is killed."""
        self._close_far()
        if self._near >= 0:
            os.close(self._near)
            self._near = -1

    def _close_far(self) -> None:
        if self.far >= 0:
            with contextlib.suppress(OSError):
                os.close(self.far)
            self.far = -1
