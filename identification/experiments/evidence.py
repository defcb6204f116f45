"""Evidence that a trial is expected to give between hypotheses.

With y_i what the sensors show under hypothesis i, W the whitening filter of the noise and N the
sensitivities to everything else that is uncertain (unit priors), hypothesis i is distinguished from
j by

    D_ij = E_i min over c, s_j, t_j of  1/2 ( |W (y_i - s_j u_j - V_j t_j) - N c|^2 + |c|^2 +
    |t_j|^2 )

nats: the expected log-likelihood ratio after j has been fitted as well as it can be, with the
vehicle's parameters c, its size s_j and its shapes t_j. u_j: response to the effect per typical
size. A size is not smaller than what is of interest, so that "nothing" and an effect exclude each
other. Both are linear about the most likely size. The mean over i's own size is taken at two
points. A constant offset of each sensor counts for nothing: it is among the N, since no trial is
needed to identify it.

This is T-optimality (Atkinson and Fedorov, Biometrika 62 (1975), 57-70) with priors. Of two
directions the smaller one counts; of several pairs the sum of ln(1 + D), so that no pair is bought
with another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from slipbench.identification.experiments.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sensitivity import sensitivities
from slipbench.identification.mismatch.fit.stack import Nuisances, bounded, whiten_and_stack
from slipbench.identification.mismatch.motorcycle.menu import Choice
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.signals import Floats

FREE = 1e4
"""Norm of the response to a unit of an offset, whose prior is then none."""
SLIGHT = 1e-9
"""Weight of the prior on a size: there is none, but the normal matrix has to be regular."""


@dataclass(frozen=True)
class Evidence:
    """Expected nats of each pair of hypotheses, by their names; the smaller direction of each."""

    nats: dict[tuple[str, str], float]

    @property
    def worth(self) -> float:
        """Criterion of the design: sum of ln(1 + nats)."""
        return float(sum(np.log1p(nats) for nats in self.nats.values()))

    @property
    def least(self) -> float:
        """Evidence of the pair that is distinguished worst, nats."""
        return min(self.nats.values())


def rehearsed(known: Fit, choice: Choice) -> Linearization:
    """Expected response of a trial, and the part that the uncertain parameters can explain.

    known: the calibrated vehicle with the noise of its recordings. Raises ValueError where the
    vehicle has no steady state at the operating point.
    """
    record = known.model.at(known.point).rehearse(known.model.records[0], choice)
    model = replace(known.model, records=(record,), injected=()).coarse
    point = replace(model.origin(), x=known.point.x, effects=known.point.effects)
    slopes = sensitivities(model, point)
    fit = Fit(model, point, predict(model, point), known.noise, slopes)
    columns = np.concatenate((fit.nuisances.columns, _offsets(fit)), axis=1)
    fit.__dict__["nuisances"] = Nuisances(columns)
    z = np.zeros(columns.shape[1])
    nuisances = fit.nuisances
    return Linearization(
        fit,
        nuisances,
        nuisances.projected_residuals(fit.whitened_residuals, z),
        nuisances.clustered(fit.clusters),
    )


def _offsets(fit: Fit) -> Floats:
    """Whitened responses to a constant of each output, (rows, outputs), so large that priors are none."""
    model = fit.model
    width = sum(len(block.outputs) for block in model.partition.groups)
    found = [[np.zeros((*m.shape, width)) for m in ms] for ms in model.measured]
    first = 0
    for block, series in zip(model.partition.groups, found, strict=True):
        for one in series:
            for j in range(len(block.outputs)):
                one[:, j, first + j] = 1.0
        first += len(block.outputs)
    columns = whiten_and_stack(model, fit.noise, found)
    return np.asarray(FREE * columns / (np.linalg.norm(columns, axis=0) + 1e-300))


def expected_evidence(linear: Linearization, questions: Sequence[Sequence[Hypothesis]]) -> Evidence:
    """Expected nats of every pair within each question: a set of hypotheses that exclude each other."""
    nats = dict[tuple[str, str], float]()
    for question in questions:
        responses = {h.name: _Response.of(linear, h) for h in question}
        for a, b in combinations(question, 2):
            there, back = responses[a.name], responses[b.name]
            nats[a.name, b.name] = min(there.against(back, linear), back.against(there, linear))
    return Evidence(nats)


@dataclass(frozen=True, eq=False)
class _Response:
    """Whitened responses to a hypothesis.

    drawn: (rows, k) at the sizes that are averaged over; columns: (rows, q), q effect parameters, per
    typical size and per deviation of each shape; low, high: of the size
    """

    drawn: Floats
    columns: Floats
    low: float = 0.0
    high: float = 0.0

    @classmethod
    def of(cls, linear: Linearization, hypothesis: Hypothesis) -> "_Response":
        candidate = hypothesis.candidate
        if candidate is None:
            rows = len(linear.nuisances.columns)
            return cls(np.zeros((rows, 1)), np.zeros((rows, 0)))
        sizes = hypothesis.sizes()
        found = linear.effect_responses([*sizes, *_moved(candidate)])
        drawn, about = found[:, : len(sizes)], found[:, len(sizes) :]
        return cls(drawn, _columns(candidate, about), *_ends(candidate))

    def against(self, other: "_Response", linear: Linearization) -> float:
        """Expected nats for this hypothesis, where it is true, against another that is fitted."""
        return float(np.mean([_left(linear, one, other) for one in self.drawn.T]))


def _left(linear: Linearization, response: Floats, other: _Response) -> float:
    """Nats that remain of a response after nuisances and another hypothesis are fitted to it."""
    nuisances, count = linear.nuisances.columns, other.columns.shape[1]
    columns = np.concatenate((nuisances, other.columns), axis=1)
    weights = np.ones(columns.shape[1])
    low, high = np.full(weights.size, -np.inf), np.full(weights.size, np.inf)
    if count:
        size = nuisances.shape[1]
        weights[size], low[size], high[size] = SLIGHT, other.low, other.high
    normal = columns.T @ columns + np.diag(weights)
    found = bounded(normal, columns.T @ response, low, high)
    rest = response - columns @ found
    return 0.5 * float(rest @ rest + np.sum(weights * found**2))


def _moved(candidate: Candidate) -> list[Candidate]:
    """The effect as it is most likely, then with each of its shapes a step away."""
    unit = np.eye(len(candidate.parameters))
    steps = candidate.difference_steps[1:]
    return [candidate, *(candidate.moved(s * unit[i]) for i, s in enumerate(steps, start=1))]


def _columns(candidate: Candidate, moved: Floats) -> Floats:
    """Responses per typical size and per deviation of each shape, (rows, q). moved: (rows, q)."""
    first, *others = moved.T
    steps = candidate.difference_steps[1:]
    shapes = [(one - first) / step for one, step in zip(others, steps, strict=True)]
    return np.stack([first / candidate.size, *shapes], axis=1)


def _ends(candidate: Candidate) -> tuple[float, float]:
    """Lowest and highest size of interest on the side of the most likely one, in typical sizes."""
    sign = 1.0 if candidate.size > 0.0 else -1.0
    least = min(candidate.smallest, abs(candidate.size))
    most = abs(candidate.resized(1e6 * sign).size)
    ends = sign * least, sign * max(most, least * 1.01)
    return min(ends), max(ends)
