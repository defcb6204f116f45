"""Work on independent parts at once, on every processor that there is."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")
WORKERS = os.process_cpu_count() if hasattr(os, "process_cpu_count") else os.cpu_count()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max(WORKERS or 1, 1))


def in_threads(work: Callable[[Part], Result], parts: Iterable[Part]) -> list[Result]:
    """Return the result of every part, in the order of the parts, whatever thread was first.

    Raises what the first part in that order raises. Work must not itself work in threads.
    """
    return list(_pool().map(work, parts))


os.register_at_fork(after_in_child=_pool.cache_clear)
