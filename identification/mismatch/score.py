"""What each candidate effect would explain, without fitting it: its signature off the nuisances."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import stats

from identification.mismatch.candidate import (
    LARGE,
    Candidate,
    candidates,
    otherwise,
    reshaped,
)
from identification.mismatch.fitting import Fit
from identification.mismatch.model import Runs, Series, predict
from identification.mismatch.sensitivity import change
from identification.mismatch.stack import Integers, Nuisances, clusters, flat
from plant.effects.effect import Effect
from plant.signals import Floats
from plant.trouble import PlantError

SHARE_OF_SMALL = 0.1
"""Effects below this share of the smallest size of interest do not count."""
HINT = 0.5
"""Nats of an amplitude, either sign, above which an effect is looked at more closely."""
SHOWN = 6.0
"""Nats that an effect of typical size must be worth to count as excited."""
RESHAPED = 8
BATCH = 32


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
    runs: Runs = field(default_factory=dict)

    @classmethod
    def of(cls, fit: Fit) -> "Judge":
        """Prepare to judge what a fit leaves; the dials of its effects may vary as well."""
        nuisances = fit.nuisances
        if fit.candidates:
            nuisances = Nuisances(np.concatenate((nuisances.columns, fit.columns), axis=1))
        return cls(fit, nuisances, nuisances.off(fit.aim), clusters(fit.model, fit.noise))

    @cached_property
    def coarse(self) -> Series:
        """What sensors would show, simulated with the coarse steps of the signatures."""
        return predict(self.fit.model.coarse, self.fit.point, runs=self.runs)

    def signature(self, candidate: Candidate) -> Floats:
        """Whitened change of all outputs that a candidate brings; zeros where it cannot be run."""
        return self.signatures([candidate])[:, 0]

    def signatures(self, tried: Sequence[Candidate]) -> Floats:
        """Return the signatures of several candidates side by side, (rows, candidates)."""
        model = self.fit.model
        found = [[np.zeros((*m.shape, len(tried))) for m in ms] for ms in model.measured]
        for i, candidate in enumerate(tried):
            for into, changed in zip(found, self._change(candidate), strict=True):
                for r, one in enumerate(changed):
                    if one.size:
                        into[r][:, :, i] = one
        return np.nan_to_num(flat(model, self.fit.noise, found), posinf=0.0, neginf=0.0)

    def _change(self, candidate: Candidate) -> Series:
        fit = self.fit
        try:
            effects = (*fit.point.effects, candidate.effect())
            return change(fit.model.coarse, fit.point, effects, self.coarse, self.runs)
        except PlantError:
            return [[np.empty(0)] * len(fit.model.records) for _ in fit.model.chain.blocks]

    def scores(self, tried: Sequence[Candidate]) -> list[Score]:
        """Judge candidates at their sizes."""
        found: list[Score] = []
        for first in range(0, len(tried), BATCH):
            some = tried[first : first + BATCH]
            columns = self.signatures(some)
            inside = self.nuisances.columns.T @ columns
            whole = np.einsum("ij,ij->j", columns, columns)
            energy = whole - np.einsum("ij,ij->j", inside, self.nuisances.solve(inside))
            push = columns.T @ self.left
            found += [
                self._score(c, columns[:, i], float(push[i]), float(energy[i]), float(whole[i]))
                for i, c in enumerate(some)
            ]
        return found

    def _score(
        self, candidate: Candidate, signature: Floats, push: float, energy: float, whole: float
    ) -> Score:
        if energy <= 1e-9 * max(whole, 1.0) or energy < 1e-6:
            return Score(candidate, 0.0, np.inf, 0.0, 0.0, 0.0, 1.0)
        amplitude = push / energy
        gain = 0.5 * energy * max(amplitude, 0.0) ** 2
        error, p = 1.0 / np.sqrt(energy), 1.0
        if gain > HINT:
            error, freedom = self.error(self.nuisances.off(signature), energy, amplitude)
            floor = SHARE_OF_SMALL * candidate.smallest / abs(candidate.size)
            p = float(stats.t.sf((amplitude - floor) / error, freedom))
        return Score(candidate, amplitude, error, gain, 0.5 * energy, energy / whole, p)

    def error(self, off: Floats, energy: float, amplitude: float) -> tuple[float, float]:
        """Standard deviation of an amplitude and its degrees of freedom, over stretches of time."""
        rest = self.left - amplitude * off
        push = np.bincount(self.groups, off * rest)
        weight = np.bincount(self.groups, off * off)
        count = float(weight.sum() ** 2 / (weight @ weight))
        robust = np.sqrt(float(push @ push) * count / max(count - 1.0, 0.5)) / energy
        return max(robust, 1.0 / np.sqrt(energy)), max(count - 1.0, 1.0)


def survey(judge: Judge, library: Iterable[type[Effect]]) -> list[Score]:
    """Score every effect; the best try of each, by what it explains, greatest first.

    All are tried at their typical size. Those of which there is a hint are tried at other sizes and
    shapes as well; those that would not show at their typical size, at a large one.
    """
    first = judge.scores([c for kind in library for c in candidates(kind)])
    more = [c for s in first for c in _more(s)]
    best = _best([*first, *judge.scores(more)])
    hints = [s.candidate for s in best[:RESHAPED] if s.gain > HINT]
    shaped = judge.scores([c for hint in hints for c in reshaped(hint)])
    typical: dict[str, float] = {}
    for s in first:
        typical[s.candidate.name] = max(typical.get(s.candidate.name, 0.0), s.seen)
    return [replace(s, typical=typical[s.candidate.name]) for s in _best([*best, *shaped])]


def _more(score: Score) -> list[Candidate]:
    """Return the tries that a first score asks for."""
    backwards = score.amplitude < 0.0
    if score.seen * score.amplitude**2 > HINT:
        return list(otherwise(score.candidate, backwards))
    return [score.candidate.resized(LARGE)] if 0.0 < score.seen < SHOWN else []


def _best(scores: Iterable[Score]) -> list[Score]:
    found: dict[str, Score] = {}
    for score in scores:
        name = score.candidate.name
        if name not in found or (score.gain, score.seen) > (found[name].gain, found[name].seen):
            found[name] = score
    return sorted(found.values(), key=lambda s: -s.gain)
