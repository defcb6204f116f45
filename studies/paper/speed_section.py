"""Beyond the paper: gain-scheduled model over speed, and uncertainty set for a controller."""

from collections.abc import Sequence

import numpy as np

from slipbench.identification.models.recommended import Recommended, recommended
from slipbench.identification.models.scheduled import (
    ScheduledFit,
    Trial,
    fit_scheduled,
    leave_one_out,
)
from slipbench.identification.models.uncertainty_set import Member, UncertaintySet, uncertainty_set
from slipbench.identification.report.report import Drawn
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.studies.paper import switched_figures
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.paper_section import Section, drawn
from slipbench.studies.paper.switched_claims import scheduled_claims


def speed_trials(runs: Sequence[Identification]) -> list[Trial]:
    """Main response of each run with its mean speed."""
    return [
        Trial(float(np.nanmean(run.motion.reference[run.window.exciting])), run.main)
        for run in runs
        if run.main and isinstance(run.motion, Motion) and isinstance(run.window, TrialWindow)
    ]


def scheduled(found: Found) -> Section:
    """Section on one model over speed."""
    trials = speed_trials([*runs_of(found, "speed"), runs_of(found, "throttle")[0]])
    fit = fit_scheduled(trials)
    figures: tuple[Drawn, ...] = ()
    if isinstance(fit, ScheduledFit):
        figures = drawn(
            "scheduled",
            "Model parameters over speed, with 95 % intervals.",
            lambda: switched_figures.schedule_figure(fit),
        )
    return Section(
        "10",
        "Model scheduled by speed",
        (f"One model for sweeps at {len(trials)} speeds in second gear.",),
        figures,
        scheduled_claims(leave_one_out(trials)),
    )


def uncertainty(found: Found, context: Context) -> Section:
    """Section on the uncertainty set over speeds and amplitudes."""
    title = "Uncertainty set for controller design"
    kinds = ("throttle", "large", "speed")
    members = [
        Member(name.replace("_", " "), one.main)
        for name, one in found.items()
        if name.rpartition("_")[0] in kinds and one.main
    ]
    main = runs_of(found, "throttle")[0].main
    nominal = recommended(main) if main else None
    if not isinstance(nominal, Recommended):
        reason = nominal.reason if nominal else "there is no response to slip"
        return Section("11", title, (reason,))
    made = uncertainty_set(nominal.fit.model, members)
    if not isinstance(made, UncertaintySet):
        return Section("11", title, (made.reason,))
    return Section(
        "11",
        title,
        (_words(made, context.cutoff),),
        drawn(
            "uncertainty",
            "Measured responses and the nominal model; below: their distance from it "
            "including 95 % intervals, and the stable weight that bounds them.",
            lambda: switched_figures.uncertainty_figure(made, context.cutoff),
        ),
    )


def _words(made: UncertaintySet, cutoff: float) -> str:
    whole = np.flatnonzero(made.bound >= 1)
    until = made.frequency[whole[0]] if whole.size else made.frequency[-1]
    return (
        f"The model of the first throttle sweep, and the distance of {len(made.members)} measured responses from it: other speeds, other amplitudes, other rides, each with its 95 % interval. Least {100 * made.bound.min():.0f} %, most {100 * made.bound.max():.0f} %; below "
        f"100 % up to {until / cutoff:.2f} w_c. With the model and its weight a controller can be shown to be stable for "
        "all of them (small gain theorem)."
    )
