"""Verdict on an identified run: quick look, adequacy of the models, held-out data."""

import numpy as np

from slipbench.identification.models.recommended import Recommended
from slipbench.identification.models.study import Study
from slipbench.identification.models.validation import Validation
from slipbench.identification.report.headline import why_not
from slipbench.identification.report.run_verdict import RunVerdict
from slipbench.identification.report.words import name
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.response import reliable_band
from slipbench.identification.session.quick_look import QuickLook, quick_look
from slipbench.identification.session.thresholds import THRESHOLDS
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.codec.faults import Fault


def run_verdict(found: Identification, study: Study) -> RunVerdict:
    """Verdict on a run: not usable, usable with reservations, or good, each with its reasons.

    Not usable: no reliable response, or the quick look says that the run does not count. Reservations:
    what the quick look, the residual tests, the held-out fit or the recording hold against it.
    """
    look = quick_look(found)
    against = _unusable(found, look)
    if against:
        return RunVerdict("not usable", (against,))
    doubts = (*_of_the_run(found, look), *_without_model(found, study), *_of_the_models(study))
    if doubts:
        return RunVerdict("usable with reservations", doubts)
    return RunVerdict("good", (_summary(found, look), *map(_held_out, study.validations[:1])))


def _summary(found: Identification, look: QuickLook) -> str:
    band = reliable_band(found.main) if found.main else None
    if found.pair is None or found.main is None or band is None:
        return look.verdict.reason
    least = float(np.median(found.main.coherence))
    return f"{band[0]:.2g} to {band[1]:.3g} Hz reliable, coherence {least:.2f}"


def _unusable(found: Identification, look: QuickLook) -> str:
    figures, verdict = look.measures, look.verdict
    if figures.trip or figures.late:
        return verdict.reason
    if found.following is not None:
        return ""
    if found.main is None:
        why = why_not(found) or figures.no_response
        return f"there is no frequency response: {why}{_remedy(found)}"
    if reliable_band(found.main) is None:
        return "no frequency of the response is reliable"
    return "" if verdict.counts or found.recording.trial is None else verdict.reason


def _remedy(found: Identification) -> str:
    if isinstance(found.window, TrialWindow):
        return ""
    return ". Select a part with --window, --input and --output"


def _of_the_run(found: Identification, look: QuickLook) -> tuple[str, ...]:
    made = []
    if found.following is not None:
        made.append("the trial ran under slip control: it shows the controller, not the motorcycle")
    elif found.pair is not None and found.main is not None:
        share = float(found.main.reliable.mean())
        if share < THRESHOLDS.covered.value:
            made.append(f"only {100 * share:.0f} % of the excited band is reliable")
    elif look.verdict.word != "good":
        made.append(look.verdict.reason)
    made += [one.reason for one in found.left_out if "the input follows the output" in one.reason]
    count = sum(f.count for f in found.recording.faults if f.fault != Fault.UNKNOWN)
    if count:
        made.append(f"{count} frames are faulty")
    return (*made, *(str(w) for w in found.recording.description.get("warnings", [])))


def _without_model(found: Identification, study: Study) -> tuple[str, ...]:
    """Why a selected part has no model; of a trial the quick look says what it is worth."""
    if found.pair is None or study.models:
        return ()
    return tuple(f"there is no {one.analysis}: {one.reason}" for one in study.left_out)


def _of_the_models(study: Study) -> tuple[str, ...]:
    made = [f"the model from {_path(m)} fails the chi-square test" for m in _inadequate(study)]
    made += [one for v in study.validations for one in _of_validation(v)]
    return tuple(made)


def _inadequate(study: Study) -> list[Recommended]:
    return [one for one in study.models if not one.adequate]


def _path(of: Recommended) -> str:
    return f"{name(of.response.input)} to {name(of.response.output)}"


def _of_validation(checked: Validation) -> list[str]:
    path, made = f"{name(checked.input)} to {name(checked.output)}", []
    if checked.fit < THRESHOLDS.held_out.value:
        made.append(f"the model from {path} fits held-out data with NRMSE {checked.fit:.0f} %")
    if checked.missing > THRESHOLDS.missing.value:
        made.append(
            f"the model from {path} lacks dynamics: {100 * checked.missing:.0f} % of the output depends on the"
            " input and is not in the model"
        )
    return made


def _held_out(checked: Validation) -> str:
    return f"NRMSE fit {checked.fit:.1f} % on held-out data ({checked.held_out})"
