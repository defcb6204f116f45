"""Detection of a stopped loop: it neither ends nor reports, but writes no more to its ring."""

from slipbench.bench.loop.ring import Ring


class Liveness:
    """Number of checks in a row in which a ring had no new entry.

    It counts checks and not seconds: a process that is stopped together with the loop (Ctrl-Z) makes
    no checks meanwhile.
    """

    def __init__(self, ring: Ring, patience: int) -> None:
        """Report the loop as stopped after more than `patience` checks without a new entry."""
        self._ring, self._patience = ring, patience
        self._written = self._checks = 0

    def stopped(self) -> bool:
        """Check the ring; True after too many checks in a row without a new entry."""
        written = self._ring.written
        self._checks = self._checks + 1 if written == self._written else 0
        self._written = written
        return self._checks > self._patience
