"""Results that are needed again soon: the last few are kept for each recording."""

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from slipbench.identification.mismatch.simulation.record import Record

Result = TypeVar("Result")


class Recent(Generic[Result]):
    """The results of the last few keys of each recording, the oldest dropped first.

    A recording that is gone takes its results with it. Two threads that need one result at once may
    both compute it; both find the same. Results are shared, so nobody may write into them.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._kept: WeakKeyDictionary[Record, dict[Hashable, Result]] = WeakKeyDictionary()

    def of(self, record: Record, key: Hashable, work: Callable[[], Result]) -> Result:
        """Return the result of a key, computed where it is not kept."""
        kept = self._kept.setdefault(record, {})
        found = kept.get(key)
        if found is None:
            found = work()
        kept.pop(key, None)
        kept[key] = found  # the newest stands last
        for old in list(kept)[: -self._most]:
            kept.pop(old, None)
        return found
