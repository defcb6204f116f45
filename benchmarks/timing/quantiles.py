"""Row of a table of lateness."""

from dataclasses import dataclass

import numpy as np

HEAD = f"{'':38}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>10}{'ticks':>9}{'skipped':>9}   us"


@dataclass(frozen=True)
class Row:
    """Lateness of the ticks of one program, ns, shape (n,); `skipped` ticks did not run."""

    name: str
    lateness: np.ndarray
    skipped: int = 0

    @property
    def p99(self) -> float:
        """99th percentile of the lateness, ns."""
        return float(np.percentile(self.lateness, 99))

    def __str__(self) -> str:
        """The row as text, us."""
        quantiles = np.percentile(self.lateness, [50, 99, 99.9, 100]) * 1e-3
        p50, p99, p999, most = quantiles
        return (
            f"{self.name:38}{p50:9.1f}{p99:9.1f}{p999:9.1f}{most:10.1f}"
            f"{self.lateness.size:9}{self.skipped:9}"
        )


def absent(name: str, why: str) -> str:
    """Row of a program that is not installed, with the reason."""
    return f"{name:38}not measured: {why}"
