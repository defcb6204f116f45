"""Parallel work on independent parts, on all available processors."""

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")
WORKERS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
_here = threading.local()


@contextmanager
def one_thread() -> Iterator[None]:
    """Do all work of the `with` block in this thread: the other processors are in use."""
    before, _here.working = getattr(_here, "working", False), True
    try:
        yield
    finally:
        _here.working = before


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max(WORKERS or 1, 1))


def in_threads(work: Callable[[Part], Result], parts: Iterable[Part]) -> list[Result]:
    """Return the result of every part, in the order of the parts.

    Raises the exception of the first part in that order that fails. Nested calls run sequentially,
    since threads that wait for each other would deadlock.
    """
    if getattr(_here, "working", False):
        return [work(part) for part in parts]

    def run(part: Part) -> Result:
        _here.working = True
        return work(part)

    return list(_pool().map(run, parts))


os.register_at_fork(after_in_child=_pool.cache_clear)
