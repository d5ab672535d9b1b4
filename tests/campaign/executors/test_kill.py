"""A campaign whose process is killed or interrupted: what was committed stays, the rest is run again, nobody is left behind."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from kill_campaign import CHUNK, POINTS, WORKERS
from kill_watch import Campaign, all_gone, check_the_end, check_the_kill

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs the process table of Linux")


def test_killed_campaign_resumes_to_the_same_results(tmp_path: Path) -> None:
    campaign, rng, kills = Campaign(tmp_path), np.random.default_rng(1), []
    for _ in range(3):
        in_flight = len(campaign.lines("begin")) - len(campaign.lines("end"))
        code, _ = campaign.stop_after(int(rng.integers(1, 120)), signal.SIGKILL)
        assert code == -signal.SIGKILL
        kills.append((check_the_kill(campaign, in_flight), len(campaign.lines("begin"))))
    check_the_end(campaign, kills)


def test_interrupt_keeps_what_was_answered_and_says_how_to_go_on(tmp_path: Path) -> None:
    campaign = Campaign(tmp_path)
    code, said = campaign.stop_after(50, signal.SIGINT)
    committed = campaign.committed()
    assert code == 130
    assert said.startswith(f"interrupted after {len(committed)} of {len(POINTS)} evaluations")
    assert "--resume" in said
    assert len(set(campaign.lines("end")) - committed) <= CHUNK * WORKERS
    assert all_gone(campaign.workers())
    assert list((tmp_path / "tmp").iterdir()) == []
