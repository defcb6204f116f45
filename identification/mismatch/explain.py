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
from slipbench.identification.mismatch.comparison import Comparison
from slipbench.identification.mismatch.curves.fit_in_model import MOST as MOST_CURVES
from slipbench.identification.mismatch.curves.fit_in_model import fit_curves_in_model
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.operating_region import operating_region, plainest
from slipbench.identification.mismatch.curves.trace import effect_of
from slipbench.identification.mismatch.fit.calibrate import (
    at_prior_mean,
    calibrate,
    far_from_prior,
    hidden_by_noise,
)
from slipbench.identification.mismatch.fit.crank_phase import at_estimated_angles, lines
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
    _keep_located(a, Comparison(a.base, a.base, a.held_out))


def _keep_located(a: Analysis, compared: Comparison) -> None:
    """Locate curves in the residual of calibration, and where the best acts if it is significant."""
    a.before, a.operating_region = compared.curves(), None
    if a.before and a.before[0].significant:
        a.operating_region = operating_region(Linearization.of(compared.base), a.before[0])


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
        a.after, a.remains = Comparison(a.named.base, a.named.fit, a.held_out).curves_beside_names()


def _free(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    """Replace the names by a free curve where they are insufficient and it predicts better."""
    assert a.base is not None
    assert a.named is not None
    compared = Comparison(a.base, a.named.fit, a.held_out)
    _names_or_curve(a, compared, say)
    _names_or_one_curve(a, compared, say)
    if a.free is None and _error_is_large(a):
        say("Localizing what the noise model may take for noise")
        _free_by_least_squares(a, compared.by_least_squares(), say)


def _free_by_least_squares(a: Analysis, plain: Comparison, say: Say) -> None:
    """Look for a free curve by plain least squares, since a noise model takes levels for noise.

    Names give way to one curve that predicts better. Several curves can replace the names and
    explain the rest of the error as well, so they are no comparison. Where nothing was found
    before, the location counts without a curve.
    """
    assert a.named is not None
    trial = replace(a, names_kept=None, vetoes=list(a.vetoes))
    if a.named.names:
        trial.after, trial.remains = plain.curves_beside_names()
    if not a.named.names or unexplained(trial):
        _keep_located(trial, plain)
        trial.headline = _headline(trial)
        _names_or_curve(trial, plain, say, most=1 if a.named.names else MOST_CURVES)
        if trial.free is not None or not (a.named.names or unexplained(a)):
            vars(a).update(vars(trial))


def _error_is_large(a: Analysis) -> bool:
    """Return whether a held-out error of the named effects, or of calibration, is large."""
    assert a.base is not None
    assert a.named is not None
    if a.held_out is None:
        return False
    runs = held_out_simulations(a.held_out, a.base, a.named.fit, None)
    return any(e.large for e in errors(runs))


def _names_or_curve(a: Analysis, compared: Comparison, say: Say, most: int = MOST_CURVES) -> None:
    """Decide between names that are insufficient and free curves. most: number of curves.

    Without such a curve, names stay only if they gain more nats than a free curve gains in their
    residual, and if the held-out recordings confirm them.
    """
    _fit_curve(a, compared, say, most)
    if unexplained(a) and a.free is None and a.remains is not None and a.remains.lesser:
        a.names_kept = _names_predict_better(a, compared, CONFIRMED)


def _names_or_one_curve(a: Analysis, compared: Comparison, say: Say) -> None:
    """Replace adequate names by one free curve that predicts better.

    A wrong name can explain nearly all of an error, but not as precisely as what is missing: a dead
    band named stiction left 2 % of the mean square, and 20 % of the log-likelihood gain.
    """
    undecided = a.names_kept is None and not unexplained(a) and compared.held_out is not None
    if undecided and a.remains is not None and a.remains.comparable:
        trial = replace(a, names_kept=False, vetoes=list(a.vetoes))
        _fit_curve(trial, compared, say, most=1)
        if trial.free is not None:
            vars(a).update(vars(trial))


def _fit_curve(a: Analysis, compared: Comparison, say: Say, most: int) -> None:
    while unexplained(a) and a.before and a.free is None:
        say("Fitting a free curve in the simulation")
        found = fit_curves_in_model(compared.base, a.before, compared.held_out, most)
        if found is None:
            return
        gain = _confirmed(compared, found)
        curve = f"free curve: {found.curve.place} along {found.curve.regressor}"
        if gain >= CONFIRMED:
            a.names_kept = _names_predict_better(a, compared, gain)
            if not a.names_kept and (ratio := _error_ratio(compared, found)) > RISEN_ERROR:
                reason = f"with it a held-out error is {ratio:.3g} times as large"
                a.vetoes.append(Veto(curve, gain, CONFIRMED, reason))
                return  # held-out recordings confirm the place, but not this curve
            a.free = None if a.names_kept else found.at_fitted_noise()
        elif any(c.significant and c.place == found.curve.place for c in a.before):
            a.vetoes.append(veto(curve, gain, CONFIRMED))
            _withdraw(a, found.curve.place)
        else:
            return


def _confirmed(compared: Comparison, found: FreeCurve) -> float:
    """Return the held-out log-likelihood gain of a curve, nats; inf without held-out recordings.

    The smaller of two gains: with all parameters estimated again, and with the parameters of the
    training recordings within their uncertainty; -inf where they cannot be simulated with these.
    """
    if compared.held_out is None:
        return math.inf
    assert found.proven is not None
    try:
        predicted = predicted_gain(compared.held_out, compared.base, found.fit, found.proven)
    except PlantError:
        return -math.inf
    return min(found.confirmed, predicted)


def _error_ratio(compared: Comparison, found: FreeCurve) -> float:
    """Return the held-out error with a curve over that without, of the output where it is largest."""
    if compared.held_out is None:
        return 1.0
    assert found.proven is not None
    return error_ratio(compared.held_out, compared.base, found.fit, found.proven)


def _names_predict_better(a: Analysis, compared: Comparison, gain: float) -> bool:
    """Return whether there are names that predict better than a curve. gain: of it, nats."""
    assert a.named is not None
    return bool(a.named.names) and compared.names_predict_better(gain)


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
