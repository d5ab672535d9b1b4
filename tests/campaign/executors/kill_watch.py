"""What tests of kills need: to start the campaign, to stop it, and to find out what it left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from executor_models import answers
from kill_campaign import CHUNK, POINTS, WORKERS, opened

SCRIPT = Path(__file__).with_name("kill_campaign.py")


class Campaign:
    """The process of a campaign in a folder, and what its workers have written down."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "tmp").mkdir(exist_ok=True)
        (folder / "log").touch()

    def start(self) -> subprocess.Popen[str]:
        environment = {**os.environ, "TMPDIR": str(self.folder / "tmp")}
        return subprocess.Popen([sys.executable, str(SCRIPT), str(self.folder)], env=environment, stdout=subprocess.PIPE, text=True)

    def stop_after(self, more: int, how: signal.Signals) -> tuple[int, str]:
        """Run until so many more evaluations have ended, then send a signal."""
        before = len(self.lines("end"))
        with self.start() as process:
            while len(self.lines("end")) < before + more:
                assert process.poll() is None
                time.sleep(0.002)
            process.send_signal(how)
            said, _ = process.communicate()
        return process.returncode, said

    def lines(self, what: str) -> list[bytes]:
        """Points of which this has been written down, in order."""
        words = [line.split() for line in (self.folder / "log").read_text().splitlines()]
        return [bytes.fromhex(point) for kind, _, point in words if kind == what]

    def workers(self) -> set[int]:
        return {int(line.split()[1]) for line in (self.folder / "log").read_text().splitlines()}

    def committed(self) -> set[bytes]:
        with opened(self.folder) as store:
            found, held = store.lookup(POINTS)
            expected = answers(POINTS[found])
            np.testing.assert_array_equal(held.values, expected.values)
        return {point.tobytes() for point in POINTS[found]}


def alive(pid: int) -> bool:
    """Whether a process runs: one that only waits for its exit status to be read does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


def all_gone(pids: set[int]) -> bool:
    until = time.monotonic() + 10.0
    while any(alive(pid) for pid in pids):
        if time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True


def check_the_kill(campaign: Campaign, begun_before: int) -> set[bytes]:
    """What may be lost at a kill: what was being evaluated, and at most two chunks of each worker on their way to the disk."""
    assert all_gone(campaign.workers())
    committed = campaign.committed()
    ended, begun = campaign.lines("end"), campaign.lines("begin")
    assert committed <= set(ended)
    assert len(set(ended) - committed) <= 2 * CHUNK * WORKERS
    assert len(begun) - len(ended) <= begun_before + WORKERS
    return committed


def check_the_end(campaign: Campaign, kills: list[tuple[set[bytes], int]]) -> None:
    """Run to the end: the results of a campaign that nobody killed, and nothing committed was begun again after its kill."""
    with campaign.start() as process:
        pass
    assert process.returncode == 0
    for committed, begun in kills:
        assert not committed & set(campaign.lines("begin")[begun:])
    found, expected = np.load(campaign.folder / "answers.npz"), answers(POINTS)
    for name in ("values", "status", "levels"):
        np.testing.assert_array_equal(found[name], getattr(expected, name))
    assert campaign.committed() == {point.tobytes() for point in POINTS}
    assert all_gone(campaign.workers())
    assert list((campaign.folder / "tmp").iterdir()) == []
