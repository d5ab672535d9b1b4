"""BLAS on one thread, whoever asks for it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from levelone.uncertainty.blas import OneBlasThread


def threads() -> set[int]:
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def inside() -> set[int]:
    with OneBlasThread():
        return threads()


@pytest.fixture
def two_threads():
    with threadpool_limits(limits=2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("this BLAS has one thread only")
    return


@pytest.mark.usefixtures("two_threads")
def test_a_worker_thread_can_set_the_limit_after_the_main_thread_has():
    before = threads()
    assert inside() == {1}
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(inside).result() == {1}
    assert inside() == {1}
    assert threads() == before
