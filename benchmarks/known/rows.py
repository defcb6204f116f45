"""Rides of a case, kept as they are made: what was stopped goes on where it was.

What a ride gave is kept under a fingerprint of all the code that it came from; other code begins
anew.
"""

import hashlib
import pickle
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from known.cases import FIRST, RIDES_EACH, Case
from known.outcome import Outcome, outcome

ROOT = Path(__file__).parents[2]
SOURCES = (
    "plant",
    "identification/signals",
    "identification/response",
    "identification/models",
    "benchmarks/known/outcome.py",
    "benchmarks/rides.py",
)
KEPT = ROOT / "build" / "accuracy"


@dataclass(frozen=True)
class Row:
    """A case and what all its rides gave."""

    case: Case
    seeds: int
    outcomes: list[Outcome]

    def errors(self, what: str, column: int) -> np.ndarray:
        """All errors of one kind."""
        return np.concatenate([getattr(o, what)[:, column] for o in self.outcomes])

    @property
    def held(self) -> np.ndarray:
        """How often intervals hold, %, (5,); NaN where no ride identified it."""
        shares = np.ma.masked_invalid([o.held for o in self.outcomes])
        return np.asarray(100 * shares.mean(axis=0).filled(np.nan))

    @property
    def late(self) -> np.ndarray:
        """Errors of the delay, ms, where it was profiled and identified."""
        found = np.abs([o.delay[0] for o in self.outcomes])
        return np.asarray(found[np.isfinite(found)])

    @property
    def driveline(self) -> np.ndarray:
        """Errors of frequency and damping, %, (m, 2), where its resonance is in the band."""
        found = np.array([o.driveline for o in self.outcomes])
        return np.asarray(found[np.isfinite(found[:, 0])])


def fingerprint() -> str:
    """Give a name to the code of rides and identification."""
    digest = hashlib.sha256()
    for source in SOURCES:
        at = ROOT / source
        files = sorted(at.rglob("*")) if at.is_dir() else [at]
        for path in (p for p in files if p.suffix in (".py", ".toml")):
            digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:12]


def ridden(case: Case, seeds: int, workers: int, until: float, kept: Path = KEPT) -> Row:
    """Ride what of a case is not kept yet, until `until` (monotonic s); give all there is."""
    path = kept / fingerprint() / f"{case.name}.pickle"
    have: dict[int, Outcome | None] = pickle.loads(path.read_bytes()) if path.exists() else {}
    missing = [seed for seed in range(FIRST, FIRST + seeds) if seed not in have]
    pieces = [
        missing[k : k + RIDES_EACH * workers] for k in range(0, len(missing), RIDES_EACH * workers)
    ]
    with ProcessPoolExecutor(workers) as pool:
        for piece in pieces:
            if time.monotonic() > until:
                break
            jobs = [(case, seed) for seed in piece]
            have.update(zip(piece, pool.map(outcome, jobs, chunksize=RIDES_EACH), strict=True))
            _keep(path, have)
    found = [have[seed] for seed in sorted(have) if seed < FIRST + seeds]
    return Row(case, len(found), [one for one in found if one is not None])


def _keep(path: Path, have: dict[int, Outcome | None]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_suffix(".part")
    half.write_bytes(pickle.dumps(have))
    half.replace(path)
