"""Steps of the mismatch analysis of a system and its recordings, in order of execution."""

import math
import sys
from collections.abc import Sequence
from dataclasses import replace

from slipbench.identification.mismatch.analysis import (
    Analysis,
    accepted,
    equivalents,
    failure_message,
    not_excited,
    unexplained,
)
from slipbench.identification.mismatch.curves.adequacy import remainder
from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.fit_in_model import fit_curves_in_model
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.locate import locate
from slipbench.identification.mismatch.curves.operating_region import operating_region, plainest
from slipbench.identification.mismatch.curves.trace import effect_of
from slipbench.identification.mismatch.fit.calibrate import (
    at_prior_mean,
    calibrate,
    far_from_prior,
    hidden_by_noise,
)
from slipbench.identification.mismatch.fit.crank_phase import at_estimated_angles, lines
from slipbench.identification.mismatch.fit.fitting import Fit, at_even_noise
from slipbench.identification.mismatch.fit.held_out import (
    Veto,
    error_ratio,
    errors,
    held_out_simulations,
    predicted_gain,
    refit_on,
    veto,
)
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sensitivity import change
from slipbench.identification.mismatch.naming.next_trial import next_trial
from slipbench.identification.mismatch.naming.search import MOST, Say, Search
from slipbench.identification.mismatch.simulation.kept import forget_results
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.thresholds import (
    CONFIRMED,
    PAIR_SHARE,
    REQUIRED_GAIN,
    RISEN_ERROR,
)
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.protocol.errors import InputError, is_interrupt


def run_analysis(so_far: Analysis, say: Say = lambda _: None) -> bool:
    """Run all steps; return whether the analysis is complete.

    An interruption or a failed step ends the analysis; `so_far` keeps the earlier results and the
    failure. Raises InputError where the recordings cannot be used at all.
    """
    try:
        analyse(so_far, say=say)
    except KeyboardInterrupt:
        return False
    except InputError:
        if so_far.done == 0:
            raise
        so_far.failure = _failure(so_far)
    except Exception as fault:  # keep earlier results on any error
        if not is_interrupt(fault):
            so_far.failure = _failure(so_far)
    return so_far.complete


def _failure(so_far: Analysis) -> str:
    fault = sys.exception()
    assert isinstance(fault, Exception)
    return failure_message(NAMES[so_far.done], fault)


def analyse(
    so_far: Analysis,
    library: Sequence[type[Effect]] | None = None,
    say: Say = lambda _: None,
    until: int | None = None,
) -> Analysis:
    """Run all steps. library: candidate effects; None: those of the system.

    until: number of steps to run; None: all.
    """
    library = so_far.system.library if library is None else library
    try:
        for number, step in enumerate(STEPS[:until], start=1):
            if number > so_far.done:
                step(so_far, library, say)
                so_far.done = number
    finally:
        forget_results()
    so_far.complete = until is None
    return so_far


def _calibrate(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    records = len(a.training.records) + (len(a.held_out.records) if a.held_out else 0)
    if takes := a.system.duration(records):
        say(takes)
    say("Calibrating nominal parameters")
    a.base = calibrate(a.training, a.training.origin())
    if a.system.turns_unseen():  # parameters compensated a wrong angle
        a.base = refit_on(at_prior_mean(a.base), a.training)
    shown = lines(a.base)
    if shown.plain:
        say("Estimating the initial angle of each recording")
        a.base, alike = at_estimated_angles(a.base, shown)
        if a.held_out is not None:
            there = refit_on(a.base, a.held_out)
            a.held_out = at_estimated_angles(there, lines(there), alike)[0].model


def _locate(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    assert a.base is not None
    say("Localizing the mismatch with free curves")
    _keep_located(a, a.base, _curves(a, a.base))


def _keep_located(a: Analysis, fit: Fit, curves: list[Curve]) -> None:
    """Keep curves located at a fit, and where the best acts if it is significant."""
    a.before = curves
    if curves and curves[0].significant:
        a.operating_region = operating_region(Linearization.of(fit), curves[0])


def _name(a: Analysis, library: Sequence[type[Effect]], say: Say) -> None:
    assert a.base is not None
    say(f"Screening {len(library)} effects")
    a.named = Search(library, say, a.held_out).named(a.base)
    a.headline = _headline(a)


def _headline(a: Analysis) -> str:
    """Return the output of the report's first sentence, chosen on the training recordings."""
    assert a.base is not None
    assert a.named is not None
    if a.named.names:
        fit = a.named.fit
        bare = replace(fit.point, effects=())
        trace = change(fit.model, bare, fit.point.effects, predict(fit.model, bare))
        return plainest(fit, trace)
    if a.before and a.before[0].significant:
        return plainest(a.base, effect_of(Linearization.of(a.base), a.before[0]))
    return a.base.model.partition.groups[-1].outputs[0]


def _doubt(a: Analysis, library: Sequence[type[Effect]], say: Say) -> None:
    """Test the residual of the named effects; search pairs of effects where it is significant.

    Pairs are also searched where parameters are far from their prior means, where the noise model
    predicts nearly all of the error, and where MOST effects are named, since fewer may suffice.
    Then drop the names that worsen the prediction of the held-out recordings.
    """
    assert a.named is not None
    _look_after(a, say)
    fit, many = a.named.fit, len(a.named.names) == MOST
    if unexplained(a) or far_from_prior(fit) or hidden_by_noise(fit) or many:
        better = Search(library, say, a.held_out).ahead(a.named, _asked_of_pairs(a))
        changed, a.named = better.fit is not a.named.fit, better
        if changed:
            a.headline = _headline(a)
            _look_after(a, say)
    predicting = Search(library, say, a.held_out).predicting(a.named)
    if predicting is not a.named:
        a.named = predicting
        a.headline = _headline(a)
        _look_after(a, say)
    a.vetoes = [v for v in a.named.vetoes if v.name not in a.named.names]
    if not a.named.names and not unexplained(a):
        _look_for_levels(a, say)


def _look_for_levels(a: Analysis, say: Say) -> None:
    """Locate by plain least squares where a held-out error stays large and nothing is significant.

    A noise model that is fitted to an error takes its levels for noise: of a sensor whose scale is
    wrong by 1 % on a section of the road only the two ends of the section were left.
    """
    assert a.named is not None
    if a.held_out is None or a.base is None:
        return
    if any(e.large for e in errors(held_out_simulations(a.held_out, a.base, a.named.fit, None))):
        say("Localizing what the noise model may take for noise")
        even = at_even_noise(a.base)
        _keep_located(a, even, _located(even, at_even_noise(refit_on(a.base, a.held_out))))
        a.headline = _headline(a)


def _asked_of_pairs(a: Analysis) -> float:
    """Return the log-likelihood gain over the names that a pair must reach, nats.

    At least ENOUGH, and PART_OF_CURVE of the gain of a free curve where that is significant.
    """
    curves = a.after if a.named and a.named.names else a.before
    found = max(
        (c.log_likelihood_gain for c in curves[:1] if unexplained(a) and c.significant), default=0.0
    )
    return max(REQUIRED_GAIN, PAIR_SHARE * found)


def _look_after(a: Analysis, say: Say) -> None:
    assert a.named is not None
    a.after, a.remains = [], None
    if a.named.names:
        say("Testing the residual of the accepted effects")
        a.after = _curves(a, a.named.fit)
        a.remains = remainder(a.named.base, a.named.fit, a.after)


def _free(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    """Replace the names by a free curve where they are insufficient and it predicts better.

    Without such a curve, names stay only if they gain more nats than a free curve gains in their
    residual, and if the held-out recordings confirm them.
    """
    _fit_curve(a, say)
    if unexplained(a) and a.free is None and a.remains is not None and a.remains.lesser:
        a.names_kept = _predict_better(a, CONFIRMED)


def _fit_curve(a: Analysis, say: Say) -> None:
    assert a.base is not None
    while unexplained(a) and a.before and a.free is None:
        say("Fitting a free curve in the simulation")
        found = fit_curves_in_model(a.base, a.before, a.held_out)
        if found is None:
            return
        gain = _confirmed(a, found)
        curve = f"free curve: {found.curve.place} along {found.curve.regressor}"
        if gain >= CONFIRMED:
            a.names_kept = _predict_better(a, gain)
            if not a.names_kept and (ratio := _error_ratio(a, found)) > RISEN_ERROR:
                reason = f"with it a held-out error is {ratio:.3g} times as large"
                a.vetoes.append(Veto(curve, gain, CONFIRMED, reason))
                return  # held-out recordings confirm the place, but not this curve
            a.free = None if a.names_kept else found
        elif any(c.significant and c.place == found.curve.place for c in a.before):
            a.vetoes.append(veto(curve, gain, CONFIRMED))
            _withdraw(a, found.curve.place)
        else:
            return


def _confirmed(a: Analysis, found: FreeCurve) -> float:
    """Return the held-out log-likelihood gain of a curve, nats; inf without held-out recordings.

    The smaller of two gains: with all parameters estimated again, and with the parameters of the
    training recordings within their uncertainty; -inf where they cannot be simulated with these.
    """
    assert a.base is not None
    if a.held_out is None:
        return math.inf
    assert found.proven is not None
    try:
        predicted = predicted_gain(a.held_out, a.base, found.fit, found.proven)
    except PlantError:
        return -math.inf
    return min(found.confirmed, predicted)


def _error_ratio(a: Analysis, found: FreeCurve) -> float:
    """Return the held-out error with a curve over that without, of the output where it is largest."""
    if a.held_out is None:
        return 1.0
    assert a.base is not None
    assert found.proven is not None
    return error_ratio(a.held_out, a.base, found.fit, found.proven)


def _predict_better(a: Analysis, gain: float) -> bool:
    """Return whether the names predict held-out recordings better than the curve in their place.

    gain: held-out gain of the curve, nats, see `_confirmed`. The gain of the names is computed in
    the same way.
    """
    assert a.base is not None
    assert a.named is not None
    if not a.named.names or a.held_out is None:
        return False
    fit = a.named.fit
    moved = refit_on(fit, a.held_out).score - refit_on(a.base, a.held_out).score
    try:
        predicted = predicted_gain(a.held_out, a.base, fit, a.held_out)
    except PlantError:  # it cannot be simulated with the parameters of the training recordings
        return False
    return min(moved, predicted) > gain


def _withdraw(a: Analysis, place: str) -> None:
    """Set p = 1 for the free curves at a place: held-out runs contradict the best of them."""
    a.before = [replace(c, p=1.0) if c.place == place else c for c in a.before]
    a.before.sort(key=lambda c: not c.significant)
    a.operating_region = None


def _prove(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    assert a.base is not None
    assert a.named is not None
    if a.held_out is not None:
        say("Validating on the held-out recordings")
        a.held_out_runs = held_out_simulations(
            a.held_out, a.base, accepted(a), a.free.proven if a.free else None
        )
        a.errors = errors(a.held_out_runs)


def _propose(a: Analysis, library: Sequence[type[Effect]], say: Say) -> None:
    assert a.named is not None
    say("Choosing the next trial")
    by_name = {kind.name: kind for kind in library}
    told = [n.split(".")[0] for names in equivalents(a.named) for n in names]
    alike = [by_name[n] for n in told if n in by_name]
    hidden = [by_name[n.split(".")[0]] for n in not_excited(a.named)]
    a.proposal = next_trial(a.named.fit, alike, hidden)


STEPS = (_calibrate, _locate, _name, _doubt, _free, _prove, _propose)
CONCLUDED = 5
"""Number of steps that identify the mismatch; the later ones validate it."""
NAMES = (
    "calibration",
    "localization",
    "effect selection",
    "residual test",
    "fit of a free curve",
    "validation on held-out recordings",
    "choice of the next trial",
)


def _curves(a: Analysis, fit: Fit) -> list[Curve]:
    return _located(fit, None if a.held_out is None else refit_on(fit, a.held_out))


def _located(fit: Fit, held_out: Fit | None) -> list[Curve]:
    others = None if held_out is None else Linearization.of(held_out)
    return locate(Linearization.of(fit), others)
