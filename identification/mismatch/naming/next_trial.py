"""The next trial: all experiment candidates are simulated, and the most informative is proposed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sensitivity import none, sensitivities
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.thresholds import EXCITED
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

HIDDEN = 4
"""Number of effects not excited among which the one with the largest response is chosen."""
CLOSELY = 3
"""Number of experiment candidates that are evaluated with all uncertain parameters."""


def next_trial(
    fit: Fit, alike: Sequence[type[Effect]], hidden: Sequence[type[Effect]]
) -> tuple[str, Any] | None:
    """Return the reason for the next trial and the trial; None if none is needed.

    alike: effects that could not be distinguished; hidden: effects that were not excited.
    """
    if len(alike) < 2 and not hidden:
        return None
    questions = [tuple(alike[:2])] if len(alike) > 1 else [(kind,) for kind in hidden[:HIDDEN]]
    approximate = [
        w
        for choice in fit.model.system.experiments()
        for w in _gains_if_known(fit, choice, questions)
    ]
    selected = sorted((w for w in approximate if w[0] > EXCITED), key=lambda w: -w[0])[:CLOSELY]
    evaluated = [
        (_gain_of_trial(fit, choice, kinds), choice, kinds) for _, choice, kinds in selected
    ]
    gain, best, kinds = max(evaluated, key=lambda w: w[0], default=(0.0, None, ()))
    if gain < EXCITED:
        return None
    names = " from ".join(k.name for k in kinds)
    verb = "distinguish" if len(kinds) > 1 else "show"
    why = f"{best} would {verb} {names.replace('_', ' ')} (expected log-likelihood gain {gain:.0f} nats)"
    return why, best


def _gains_if_known(
    fit: Fit, choice: Any, questions: Sequence[Sequence[type[Effect]]]
) -> list[tuple[float, Any, Sequence[type[Effect]]]]:
    """Gain by which a trial reveals or separates effects if the system is known exactly, nats."""
    linear = _simulated_trial(fit, choice, exact=True)
    return (
        []
        if linear is None
        else [(_expected_gain(linear, fit, kinds), choice, kinds) for kinds in questions]
    )


def _gain_of_trial(fit: Fit, choice: Any, kinds: Sequence[type[Effect]]) -> float:
    """Gain by which a trial reveals one effect or separates two, nats."""
    linear = _simulated_trial(fit, choice, exact=False)
    return 0.0 if linear is None else _expected_gain(linear, fit, kinds)


def _expected_gain(linear: Linearization, fit: Fit, kinds: Sequence[type[Effect]]) -> float:
    responses = [_response(linear, fit, kind) for kind in kinds]
    return _separation(linear, *responses) if len(responses) > 1 else _energy(linear, responses[0])


def _simulated_trial(fit: Fit, choice: Any, exact: bool) -> Linearization | None:
    """Return the linearization of a simulated trial; exact: without uncertain parameters."""
    try:
        record = fit.model.at(fit.point).rehearse(fit.model.records[0], choice)
    except ValueError:
        return None
    model = replace(fit.model, records=(record,), injected=()).coarse
    point = replace(model.origin(), x=fit.point.x, effects=fit.point.effects)
    slopes = none(model, point) if exact else sensitivities(model, point)
    return Linearization.of(Fit(model, point, predict(model, point), fit.noise, slopes))


def _response(linear: Linearization, fit: Fit, kind: type[Effect]) -> Floats:
    """Whitened response of an effect at its fitted size, or else at its typical one."""
    fitted = next((c for c in fit.effects if c.kind is kind), None)
    return linear.effect_response(fitted or _typical(kind))


def _typical(kind: type[Effect]) -> Candidate:
    return next(candidates(kind))


def _energy(linear: Linearization, response: Floats) -> float:
    projected = linear.nuisances.project_out(response)
    return 0.5 * float(projected @ projected)


def _separation(linear: Linearization, a: Floats, b: Floats) -> float:
    projected = linear.nuisances.project_out(b)
    energy = float(projected @ projected)
    share = float(projected[: len(a)] @ a) / energy if energy > 0.0 else 0.0
    return _energy(linear, np.asarray(a - share * b))
