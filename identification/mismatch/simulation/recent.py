"""Cache of results: the last few are kept for each recording."""

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from slipbench.identification.mismatch.simulation.record import Record

Result = TypeVar("Result")


class Recent(Generic[Result]):
    """The results of the last few keys of each recording, the oldest dropped first.

    Results of a deleted recording are deleted with it. Two threads that need one result at the same
    time may both compute it; both get the same. Results are shared and must not be modified.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._kept: WeakKeyDictionary[Record, dict[Hashable, Result]] = WeakKeyDictionary()

    def of(self, record: Record, key: Hashable, work: Callable[[], Result]) -> Result:
        """Return the result of a key; compute it if it is not kept."""
        kept = self._kept.setdefault(record, {})
        result = kept.get(key)
        if result is None:
            result = work()
        kept.pop(key, None)
        kept[key] = result  # the newest is last
        for old in list(kept)[: -self._most]:
            kept.pop(old, None)
        return result
