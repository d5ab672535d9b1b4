"""One worker process, seen from its parent: start it, hand it points, take its answers, end it and say how it ended."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import deque
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from levelone.campaign import worker
from levelone.campaign.models.protocol import TAIL, FloatArray
from levelone.campaign.tether import Tether

#: one thread for each library that would start one for each core: there is one worker for each core
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR", "NUMBA")} | {
    "VECLIB_MAXIMUM_THREADS": "1"
}
#: said of a late evaluation, so that a model whose every process is late at its first is not taken for one that hangs
FIRST = " (the first evaluation of its process, and the opening of the model with it: a longer time limit may be all it needs)"
#: s, a message that stops halfway for as long as this comes from a process that is no more
STALLED = 30
#: s, how long a process may take to end once its channel is closed, and to write where it hangs
ENDING, DUMPING = 1.0, 0.05


class Child:
    """A worker process with its channel, its folder and what it was given to do.

    Parameters
    ----------
    folder
        Made here, and removed when the process has ended: its temporary files, and the output of the model.
    pickled
        The model.

    Attributes
    ----------
    channel
        To wait on.
    ready
        Whether it has opened the model.
    answered
        Whether it has finished an evaluation.
    assigned
        Indices of the points that it holds; it is at work on the first.
    since
        When it began that (or its start), s of the monotonic clock.

    Raises
    ------
    OSError
        The process cannot be started; nothing of it is left but its folder.
    """

    def __init__(self, folder: Path, pickled: bytes) -> None:
        self.folder = folder
        self.ready = self.answered = False
        self.assigned: deque[int] = deque()
        self._given = 0.0, 1
        (folder / "tmp").mkdir(parents=True)
        ours, theirs = socket.socketpair()
        with contextlib.ExitStack() as undo, theirs:
            undo.callback(ours.close)
            self._tether = Tether()
            undo.callback(self._tether.release)
            self.process = self._started(theirs.fileno())
            undo.callback(self._kill)
            self._tether.tie(self.process.pid)
            limit = struct.pack("ll", STALLED, 0)
            for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
                ours.setsockopt(socket.SOL_SOCKET, option, limit)
            undo.pop_all()
        self.channel = Connection(ours.detach())
        self.since = time.monotonic()
        self._send((sys.path, pickled))

    def _started(self, channel: int) -> subprocess.Popen[bytes]:
        with (self.folder / "output").open("ab") as output:
            return subprocess.Popen(
                [sys.executable, "-P", "-u", str(worker.__file__), str(channel), str(self._tether.far)],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                pass_fds=(channel, self._tether.far),
                start_new_session=True,
                env={**os.environ, **ONE_THREAD, "TMPDIR": str(self.folder / "tmp")},
            )

    def assign(self, indices: list[int], points: FloatArray) -> None:
        """Hand over ``points`` [n, factors], known to the parent by ``indices`` [n]."""
        self.assigned.extend(indices)
        self.since = time.monotonic()
        self._given = self.since, len(indices)
        self._send(points)

    def pace(self) -> float:
        """s an evaluation of what was assigned last, now that all of it is answered; the parent's delays are in it."""
        began, size = self._given
        return (self.since - began) / size

    def _send(self, message: Any) -> None:
        # a process that is gone is found out by whoever waits for its answer
        with contextlib.suppress(OSError):
            self.channel.send(message)

    def receive(self) -> tuple[Any, ...] | None:
        """The next message; None where the process has ended, or has stopped halfway through a message."""
        try:
            message = self.channel.recv()
        except (EOFError, OSError):
            return None
        self.since = time.monotonic()
        return message

    def end(self, overdue: bool = False) -> str:
        """Kill what is left of the process and its group, remove its folder, and say how it ended and what it said last.

        Parameters
        ----------
        overdue
            It is to be ended because it has not answered: it is asked where it hangs, and that goes into the text.
        """
        waited = time.monotonic() - self.since
        if overdue and self.ready:
            self.process.send_signal(signal.SIGUSR1)
            time.sleep(DUMPING)
        self.channel.close()
        if not overdue:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(ENDING)
        code = self._kill()
        how = f"ended after {waited:.3g} s without an answer" if overdue else f"the process ended {_cause(code)}"
        if overdue and self.ready and not self.answered:
            how += FIRST
        said = self._output(TAIL - len(how) - 20)
        shutil.rmtree(self.folder, ignore_errors=True)
        return f"{how}; its last output: {said}" if said else how

    def close(self) -> None:
        """End the process, whatever it is doing, and remove its folder."""
        self.channel.close()
        self._kill()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _kill(self) -> int:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self._tether.release()
        return self.process.wait()

    def _output(self, most: int) -> str:
        with (self.folder / "output").open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - most))
            return file.read().decode(errors="replace").strip()


def _cause(code: int) -> str:
    if code >= 0:
        return f"with exit status {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"by signal {-code}"
    return f"by {name} (signal {-code})"
