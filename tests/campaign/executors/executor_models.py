"""Models for the tests of executors: they answer sum and product of a point, or misbehave where they are told to."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from levelone.campaign.models.protocol import Evaluations, settled
from levelone.campaign.tether import Tether
from levelone.errors import InputError
from levelone.status import Status


def answers(points: np.ndarray) -> Evaluations:
    """Sum and product; each at its own point, so that groups change nothing."""
    n = len(points)
    values = np.stack([points.sum(axis=1), points.prod(axis=1)], axis=1)
    values, status = settled(values, np.zeros((n, 2), dtype=np.int64))
    return Evaluations(values, status, (points[:, :1] > 0.5).astype(np.int64), np.zeros(n), ("",) * n)


@dataclass(frozen=True)
class Plain:
    """Vectorised and without fault."""

    names: tuple[str, ...] = ("sum", "product")
    units: tuple[str, ...] = ("1", "1")
    judged: tuple[str, ...] = ("first",)

    @property
    def key(self) -> dict[str, str]:
        return {"kind": type(self).__name__}

    def evaluate(self, points: np.ndarray) -> Evaluations:
        return answers(points)


@dataclass(frozen=True)
class Faulty(Plain):
    """What it does at a point is the point's first coordinate, if that is one of those below."""

    SEGFAULT = 101.0
    ABORT = 102.0
    EXIT = 103.0
    HANG = 104.0
    RAISE = 105.0
    NAN = 106.0
    SHAPE = 107.0
    MISTAKE = 108.0
    KILLED = 109.0
    QUIT = 110.0
    NOISE = 111.0

    def evaluate(self, points: np.ndarray) -> Evaluations:
        for first in points[:, 0]:
            self.misbehave(first)
        if (points[:, 0] == self.SHAPE).any():
            return answers(points[:-1])
        return answers(np.where(points == self.NAN, np.nan, points))

    def misbehave(self, what: float) -> None:
        if what == self.SEGFAULT:
            print("about to read address zero", file=sys.stderr)
            import ctypes

            ctypes.string_at(0)
        if what == self.ABORT:
            os.abort()
        if what == self.EXIT:
            os._exit(3)
        if what == self.HANG:
            time.sleep(1000.0)
        if what == self.RAISE:
            raise ZeroDivisionError("no such rotor")
        if what == self.MISTAKE:
            raise InputError("model.file", "there is none")
        if what == self.KILLED:
            os.kill(os.getpid(), signal.SIGTERM)
        if what == self.NOISE:
            print("what another evaluation said")
        if what == self.QUIT:
            sys.exit(4)


@dataclass(frozen=True)
class Slow(Plain):
    """Takes as many seconds as the point's first coordinate says."""

    def evaluate(self, points: np.ndarray) -> Evaluations:
        time.sleep(points[:, 0].sum())
        return answers(points)


@dataclass(frozen=True)
class Logged(Plain):
    """Writes a line to a file when it begins and when it ends an evaluation; takes a few milliseconds."""

    log: str = ""
    pause: float = 0.003

    def evaluate(self, points: np.ndarray) -> Evaluations:
        for point in points:
            self.note("begin", point)
            time.sleep(self.pause)
            self.note("end", point)
        return answers(points)

    def note(self, what: str, point: np.ndarray) -> None:
        # one write to a file opened for appending is never mixed with another's
        file = os.open(self.log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(file, f"{what} {os.getpid()} {point.tobytes().hex()}\n".encode())
        os.close(file)


@dataclass(frozen=True)
class Commanding(Plain):
    """Starts a program in a session of its own, tethered, notes its process, and hangs."""

    note: str = ""

    def evaluate(self, points: np.ndarray) -> Evaluations:
        tether = Tether()
        process = subprocess.Popen(["sleep", "1000"], pass_fds=(tether.far,), start_new_session=True)
        tether.tie(process.pid)
        Path(self.note).write_text(str(process.pid))
        time.sleep(1000.0)
        return answers(points)


@dataclass(frozen=True)
class Unopenable(Plain):
    """Cannot be opened where it arrives: raises, or ends the process."""

    how: str = "raise"

    def __setstate__(self, state: dict[str, str]) -> None:
        if state["how"] == "abort":
            os.abort()
        raise ImportError("no module named 'rotor'")


#: what a campaign records for each fault
FAULTS = {
    Faulty.SEGFAULT: (Status.CRASHED, "SIGSEGV"),
    Faulty.ABORT: (Status.CRASHED, "SIGABRT"),
    Faulty.EXIT: (Status.CRASHED, "exit status 3"),
    Faulty.KILLED: (Status.CRASHED, "SIGTERM"),
    Faulty.RAISE: (Status.MODEL_FAILED, "ZeroDivisionError: no such rotor"),
    Faulty.SHAPE: (Status.MODEL_FAILED, "shapes"),
    Faulty.QUIT: (Status.MODEL_FAILED, "SystemExit: 4"),
    Faulty.NAN: (Status.OUTPUT_NOT_FINITE, ""),
}
