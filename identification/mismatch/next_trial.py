"""Which trial would tell: all of the menu are rehearsed, and the clearest one is proposed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identification.mismatch.candidate import Candidate, candidates
from identification.mismatch.fitting import Fit
from identification.mismatch.model import predict
from identification.mismatch.score import Judge
from identification.mismatch.sensitivity import sensitivities
from plant.effects.effect import Effect
from plant.signals import Floats


def next_trial(
    fit: Fit, alike: Sequence[type[Effect]], hidden: Sequence[type[Effect]]
) -> tuple[str, Any] | None:
    """Return why and which trial to ride next; None where there is nothing to settle.

    alike: effects that could not be told apart; hidden: effects that were not excited.
    """
    if len(alike) < 2 and not hidden:
        return None
    worth = [(_worth(fit, c, alike, hidden), c) for c in fit.model.system.menu()]
    if not worth:
        return None
    nats, best = max(worth, key=lambda w: w[0])
    if nats <= 0.0:
        return None
    names = " from ".join(k.name for k in alike[:2]) if len(alike) > 1 else hidden[0].name
    verb = "tell" if len(alike) > 1 else "show"
    why = f"{best} would {verb} {names.replace('_', ' ')} ({nats:.0f} nats expected)"
    return why, best


def _worth(
    fit: Fit, choice: Any, alike: Sequence[type[Effect]], hidden: Sequence[type[Effect]]
) -> float:
    """Nats by which a trial separates what could not be told apart, or shows what was hidden."""
    judge = _rehearsed(fit, choice)
    if judge is None:
        return 0.0
    if len(alike) > 1:
        a, b = (_signature(judge, fit, kind) for kind in alike[:2])
        return _apart(judge, a, b)
    return min(_energy(judge, _signature(judge, fit, kind)) for kind in hidden[:1])


def _rehearsed(fit: Fit, choice: Any) -> Judge | None:
    try:
        record = fit.model.at(fit.point).rehearse(fit.model.records[0], choice)
    except ValueError:
        return None
    model = replace(fit.model, records=(record,), injected=())
    point = replace(model.origin(), x=fit.point.x, effects=fit.point.effects)
    predicted = predict(model, point)
    return Judge.of(Fit(model, point, predicted, fit.noise, sensitivities(model, point, predicted)))


def _signature(judge: Judge, fit: Fit, kind: type[Effect]) -> Floats:
    """Signature of an effect at its fitted size, else at its typical one."""
    fitted = next((c for c in fit.candidates if c.kind is kind), None)
    return judge.signature(fitted or _typical(kind))


def _typical(kind: type[Effect]) -> Candidate:
    return next(candidates(kind, 1))


def _energy(judge: Judge, signature: Floats) -> float:
    return 0.5 * float(judge.nuisances.off(signature) @ signature)


def _apart(judge: Judge, a: Floats, b: Floats) -> float:
    off = judge.nuisances.off(b)
    energy = float(off @ b)
    share = float(off @ a) / energy if energy > 0.0 else 0.0
    return _energy(judge, np.asarray(a - share * b))
