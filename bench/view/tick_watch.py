"""Lateness of the loop, from the lines of ticks.csv: of the last second, and counts of the whole run."""

from collections import Counter, deque

LAST = 1000  # ticks


class TickWatch:
    """The last ticks, and how many were late, skipped or refused."""

    def __init__(self) -> None:
        """Begin before the first tick."""
        self._last: deque[int] = deque(maxlen=LAST)
        self._fates: Counter[str] = Counter()
        self._worst = 0

    def observe(self, lines: bytes) -> None:
        """Process complete lines of ticks.csv; its header is ignored."""
        for line in lines.splitlines():
            parts = line.split(b",")
            if len(parts) != 4 or not parts[0].isdigit():
                continue
            self._fates[parts[3].decode("ascii", "replace")] += 1
            if parts[2].isdigit():
                late = int(parts[2])
                self._last.append(late)
                self._worst = max(self._worst, late)

    def figures(self) -> dict[str, float]:
        """Lateness in ms: median and largest of the last ticks, largest of all; counts of ticks."""
        last = sorted(self._last)
        return {
            "median": last[len(last) // 2] * 1e-6 if last else 0.0,
            "recent": last[-1] * 1e-6 if last else 0.0,
            "worst": self._worst * 1e-6,
            "ticks": sum(self._fates.values()),
            **{fate: self._fates[fate] for fate in ("late", "skipped", "refused")},
        }
