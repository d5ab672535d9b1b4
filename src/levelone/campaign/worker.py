"""A process that evaluates one model for another process: what :mod:`levelone.campaign.executors.child` starts.

It is run as a script, and imports nothing but the standard library until it knows where its parent finds modules. The messages,
all pickled by :class:`multiprocessing.connection.Connection`:

- to it, once: (``sys.path`` of the parent, the pickled model); then arrays of points [n, factors], one at a time;
- from it: ("ready",) or ("refused", field, problem) once, then for each point ("answer", Evaluations of one) in order, or
  ("refused", field, problem) where the model met a mistake of its user.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import pickle
import signal
import sys
import threading
from multiprocessing.connection import Connection
from typing import Any


def main(channel: int, lifeline: int) -> None:
    """Serve until the parent closes the channel or ends.

    Parameters
    ----------
    channel
        Descriptor of the socket to the parent.
    lifeline
        Descriptor of a pipe that ends when the parent does.
    """
    for descriptor in (channel, lifeline):
        os.set_inheritable(descriptor, False)
    # the parent decides what an interrupt means; a handler, unlike SIG_IGN, is not handed on to programs that the model starts
    signal.signal(signal.SIGINT, lambda *_: None)
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1, all_threads=False)
    threading.Thread(target=_end_with_parent, args=(lifeline,), daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        _serve(Connection(channel))
    os._exit(0)


def _end_with_parent(lifeline: int) -> None:
    """Kill the own process group when the pipe ends: where the kernel has no signal for it, see :mod:`levelone.campaign.tether`."""
    os.read(lifeline, 1)
    os.killpg(os.getpgrp(), signal.SIGKILL)


def _serve(parent: Connection) -> None:
    sys.path[:], pickled = parent.recv()
    try:
        from levelone.campaign.executors.guard import Guard
        from levelone.errors import LeveloneError

        guard = Guard(pickle.loads(pickled))  # noqa: S301 (from our own parent)
    except BaseException as error:
        parent.send(("refused", "model", _unopened(error)))
        return
    parent.send(("ready",))
    while True:
        for point in parent.recv():
            _forget_output()
            try:
                answer: tuple[Any, ...] = ("answer", guard.evaluate(point[None, :]))
            except LeveloneError as error:
                answer = ("refused", getattr(error, "field", "model"), getattr(error, "problem", str(error)))
            parent.send(answer)


def _unopened(error: BaseException) -> str:
    return (
        f"cannot be opened in a process of its own: {type(error).__name__}: {error}; what belongs to the model must stand in a "
        "module that the process can import, not in the script that is run"
    )


def _forget_output() -> None:
    """Empty the file that takes the output, so that it holds what the present evaluation says and does not grow."""
    if os.fstat(2).st_size > 0:
        os.ftruncate(2, 0)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
