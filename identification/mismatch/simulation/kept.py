"""Caches of the last results of functions whose results are large.

A fit of four recordings of a motorcycle holds 40 MB of sensitivities. The results are needed again
within one analysis only.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Function = Callable[Arguments, Result]

_clear: list[Callable[[], None]] = []


def last_results(most: int) -> Callable[[Function[Arguments, Result]], Function[Arguments, Result]]:
    """Keep the last `most` results of a function of hashable arguments."""

    def decorate(work: Function[Arguments, Result]) -> Function[Arguments, Result]:
        kept = lru_cache(maxsize=most)(work)
        _clear.append(kept.cache_clear)
        return kept

    return decorate


def forget_results() -> None:
    """Free all results that are kept."""
    for clear in _clear:
        clear()
