"""Local workers keep their memory and log nothing, unless whoever started them wants otherwise."""

import logging
import os

import pytest

from slipbench.identification.cluster import KEPT_MEMORY, Workers, done_by

NAMES = {name: (name,) for name in KEPT_MEMORY}


def told_by_a_worker() -> dict[str, str | None]:
    return dict(done_by(Workers(count=1), os.getenv, NAMES))


def test_a_local_worker_keeps_the_memory_it_had() -> None:
    assert told_by_a_worker() == {name: str(size) for name, size in KEPT_MEMORY.items()}


def test_what_the_environment_says_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "131072")
    assert told_by_a_worker()["MALLOC_TRIM_THRESHOLD_"] == "131072"


def logged(level: int) -> bool:
    """Whether a worker's own logger writes at this level."""
    return logging.getLogger("distributed.worker").isEnabledFor(level)


def test_a_worker_that_closes_during_a_heartbeat_writes_no_traceback() -> None:
    """dask logs that as an error of the worker; errors of jobs are raised where they belong."""
    levels = {"error": (logging.ERROR,), "critical": (logging.CRITICAL,)}
    assert dict(done_by(Workers(count=1), logged, levels)) == {"error": False, "critical": True}
