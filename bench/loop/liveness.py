"""A loop that was stopped neither dies nor reports: it only puts no more ticks into its ring."""

from slipbench.bench.loop.ring import Ring


class Liveness:
    """Counts looks at a ring in which nothing was new.

    Looks and not seconds: whoever is stopped together with the loop (Ctrl-Z) does not look.
    """

    def __init__(self, ring: Ring, patience: int) -> None:
        """Call it standing after more than `patience` looks in a row without anything new."""
        self._ring, self._patience = ring, patience
        self._written = self._looks = 0

    def stopped(self) -> bool:
        """Look once more; tell whether nothing has come for longer than the patience lasts."""
        written = self._ring.written
        self._looks = self._looks + 1 if written == self._written else 0
        self._written = written
        return self._looks > self._patience
