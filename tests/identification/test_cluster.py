"""Local workers keep their memory, unless whoever started them wants otherwise."""

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
