"""Which trial would tell: all of the menu are rehearsed, and the clearest one is proposed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sensitivity import none, sensitivities
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.score import SHOWN
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

HIDDEN = 4
"""Effects that were not excited, of which the one is chosen that a trial shows most plainly."""
CLOSELY = 3
"""Trials of the menu that are looked at with everything that is uncertain."""


def next_trial(
    fit: Fit, alike: Sequence[type[Effect]], hidden: Sequence[type[Effect]]
) -> tuple[str, Any] | None:
    """Return why and which trial to ride next; None where there is nothing to settle.

    alike: effects that could not be told apart; hidden: effects that were not excited.
    """
    if len(alike) < 2 and not hidden:
        return None
    asked = [tuple(alike[:2])] if len(alike) > 1 else [(kind,) for kind in hidden[:HIDDEN]]
    loud = [w for choice in fit.model.system.experiments() for w in _loudness(fit, choice, asked)]
    most = sorted((w for w in loud if w[0] > SHOWN), key=lambda w: -w[0])[:CLOSELY]
    worth = [(_worth(fit, choice, kinds), choice, kinds) for _, choice, kinds in most]
    nats, best, kinds = max(worth, key=lambda w: w[0], default=(0.0, None, ()))
    if nats < SHOWN:
        return None
    names = " from ".join(k.name for k in kinds)
    verb = "distinguish" if len(kinds) > 1 else "show"
    why = f"{best} would {verb} {names.replace('_', ' ')} (expected log-likelihood gain {nats:.0f} nats)"
    return why, best


def _loudness(
    fit: Fit, choice: Any, asked: Sequence[Sequence[type[Effect]]]
) -> list[tuple[float, Any, Sequence[type[Effect]]]]:
    """Nats by which a trial shows or separates effects, were the system known exactly."""
    linear = _rehearsed(fit, choice, exact=True)
    return [] if linear is None else [(_told(linear, fit, kinds), choice, kinds) for kinds in asked]


def _worth(fit: Fit, choice: Any, kinds: Sequence[type[Effect]]) -> float:
    """Nats by which a trial shows one effect or separates two."""
    linear = _rehearsed(fit, choice, exact=False)
    return 0.0 if linear is None else _told(linear, fit, kinds)


def _told(linear: Linearization, fit: Fit, kinds: Sequence[type[Effect]]) -> float:
    signatures = [_signature(linear, fit, kind) for kind in kinds]
    return _apart(linear, *signatures) if len(signatures) > 1 else _energy(linear, signatures[0])


def _rehearsed(fit: Fit, choice: Any, exact: bool) -> Linearization | None:
    """Return what a trial would tell; exact: of a system of which nothing is uncertain."""
    try:
        record = fit.model.at(fit.point).rehearse(fit.model.records[0], choice)
    except ValueError:
        return None
    model = replace(fit.model, records=(record,), injected=()).coarse
    point = replace(model.origin(), x=fit.point.x, effects=fit.point.effects)
    slopes = none(model, point) if exact else sensitivities(model, point)
    return Linearization.of(Fit(model, point, predict(model, point), fit.noise, slopes))


def _signature(linear: Linearization, fit: Fit, kind: type[Effect]) -> Floats:
    """Signature of an effect at its fitted size, else at its typical one."""
    fitted = next((c for c in fit.effects if c.kind is kind), None)
    return linear.effect_response(fitted or _typical(kind))


def _typical(kind: type[Effect]) -> Candidate:
    return next(candidates(kind))


def _energy(linear: Linearization, signature: Floats) -> float:
    off = linear.nuisances.project_out(signature)
    return 0.5 * float(off @ off)


def _apart(linear: Linearization, a: Floats, b: Floats) -> float:
    off = linear.nuisances.project_out(b)
    energy = float(off @ off)
    share = float(off[: len(a)] @ a) / energy if energy > 0.0 else 0.0
    return _energy(linear, np.asarray(a - share * b))
