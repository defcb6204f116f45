"""What each candidate effect would explain, without fitting it: its signature off the nuisances."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from identification.mismatch.candidate import Candidate
from identification.mismatch.fitting import Fit
from identification.mismatch.sensitivity import change
from identification.mismatch.stack import Integers, Nuisances, clusters, flat
from plant.signals import Floats
from plant.trouble import PlantError

SHARE_OF_SMALL = 0.1
"""Effects below this share of the smallest size of interest do not count."""


@dataclass(frozen=True)
class Score:
    """What a candidate's signature says about residuals.

    amplitude: of the signature, 1 = as large as tried; error: its standard deviation, robust
    against errors that hang together within 3 s. gain: nats. seen: nats that the signature would
    be worth if it were there as tried. kept: share of the signature that calibration cannot hide.
    p: one-sided, of an amplitude as small as does not count. typical: what `seen` is for the effect
    at its typical size, the most telling of its tries.
    """

    candidate: Candidate
    amplitude: float
    error: float
    gain: float
    seen: float
    kept: float
    p: float
    typical: float = 0.0


@dataclass(frozen=True, eq=False)
class Judge:
    """Everything that scoring needs, made once for a fit."""

    fit: Fit
    nuisances: Nuisances
    left: Floats
    groups: Integers

    @classmethod
    def of(cls, fit: Fit) -> "Judge":
        """Prepare to judge what a fit leaves; the dials of its effects may vary as well."""
        nuisances = fit.nuisances
        if fit.candidates:
            nuisances = Nuisances(np.concatenate((nuisances.columns, fit.columns), axis=1))
        return cls(fit, nuisances, nuisances.off(fit.aim), clusters(fit.model, fit.noise))

    def signature(self, candidate: Candidate) -> Floats:
        """Whitened change of all outputs that a candidate brings; zeros where it cannot be run."""
        fit = self.fit
        try:
            effects = (*fit.point.effects, candidate.effect())
            series = change(fit.model, fit.point, effects, fit.predicted)
        except PlantError:
            return np.zeros_like(fit.aim)
        return np.nan_to_num(flat(fit.model, fit.noise, series), posinf=0.0, neginf=0.0)

    def score(self, candidate: Candidate) -> Score:
        """Judge a candidate at its size."""
        signature = self.signature(candidate)
        off = self.nuisances.off(signature)
        energy = float(off @ signature)
        whole = float(signature @ signature)
        if energy <= 1e-9 * max(whole, 1.0) or energy < 1e-6:
            return Score(candidate, 0.0, np.inf, 0.0, 0.0, 0.0, 1.0)
        amplitude = float(off @ self.fit.aim) / energy
        error, freedom = self.error(off, energy, amplitude)
        floor = SHARE_OF_SMALL * candidate.smallest / abs(candidate.size)
        p = float(stats.t.sf((amplitude - floor) / error, freedom))
        gain = 0.5 * energy * max(amplitude, 0.0) ** 2
        return Score(candidate, amplitude, error, gain, 0.5 * energy, energy / whole, p)

    def error(self, off: Floats, energy: float, amplitude: float) -> tuple[float, float]:
        """Standard deviation of an amplitude and its degrees of freedom, over stretches of time."""
        rest = self.left - amplitude * off
        push = np.bincount(self.groups, off * rest)
        weight = np.bincount(self.groups, off * off)
        count = float(weight.sum() ** 2 / (weight @ weight))
        robust = np.sqrt(float(push @ push) * count / max(count - 1.0, 0.5)) / energy
        return max(robust, 1.0 / np.sqrt(energy)), max(count - 1.0, 1.0)

    def best(self, tried: Iterable[Candidate]) -> list[Score]:
        """Score candidates; the best of every effect, by what it explains, greatest first."""
        found: dict[str, Score] = {}
        typical: dict[str, float] = {}
        for score in map(self.score, tried):
            name = score.candidate.name
            if abs(score.candidate.size) <= 1.0:
                typical[name] = max(typical.get(name, 0.0), score.seen)
            if name not in found or (score.gain, score.seen) > (found[name].gain, found[name].seen):
                found[name] = score
        told = [replace(s, typical=typical.get(n, 0.0)) for n, s in found.items()]
        return sorted(told, key=lambda s: -s.gain)
