"""Lateness in a row of a table."""

from dataclasses import dataclass

import numpy as np

HEAD = f"{'':38}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>10}{'ticks':>9}{'skipped':>9}   us"


@dataclass(frozen=True)
class Row:
    """How late the ticks of one program were, ns; `skipped` ticks never ran."""

    name: str
    lateness: np.ndarray
    skipped: int = 0

    @property
    def p99(self) -> float:
        """99 % are earlier than this, ns."""
        return float(np.percentile(self.lateness, 99))

    def __str__(self) -> str:
        """Write the row."""
        quantiles = np.percentile(self.lateness, [50, 99, 99.9, 100]) * 1e-3
        p50, p99, p999, most = quantiles
        return (
            f"{self.name:38}{p50:9.1f}{p99:9.1f}{p999:9.1f}{most:10.1f}"
            f"{self.lateness.size:9}{self.skipped:9}"
        )


def absent(name: str, why: str) -> str:
    """Write the row of a peer that is not here."""
    return f"{name:38}not measured: {why}"
