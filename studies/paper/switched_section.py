"""Step 8: opening and closing differ, and a switched model predicts better (figures 8, 9)."""

from slipbench.identification.models.experiment import Experiment, experiment_of
from slipbench.identification.models.model_comparison import Row, compare
from slipbench.identification.models.scheduled import ScheduledFit, fit_scheduled
from slipbench.identification.models.steps import NoSteps
from slipbench.identification.response.identify import Identification
from slipbench.studies.paper import switched_figures
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.paper_section import Section, Table, drawn
from slipbench.studies.paper.speed_section import speed_trials
from slipbench.studies.paper.switched_claims import switched_claims
from slipbench.studies.paper.switched_study import SwitchedStudy, switched_study

ELSEWHERE = "13000"  # rpm of a sweep at a speed that no model was fitted at
HERE = (
    "Held-out sweeps at the speed of the steps: errors and their ratio to that of the linear model."
)
THERE = "A held-out sweep at another speed, which the scheduled model covers."


def switched(found: Found, context: Context) -> Section:
    """Section on models fitted to steps and validated on sweeps, the scheduled one at other speeds."""
    sweeps = [*runs_of(found, "throttle"), *runs_of(found, "large")]
    study = switched_study(runs_of(found, "steps"), sweeps, _scheduled(found))
    title = "Opening and closing dynamics"
    if isinstance(study, NoSteps):
        return Section("8", title, (study.reason,), (), switched_claims(study))
    return Section(
        "8",
        title,
        (
            "A linear system whose gain, real pole and zero depend on the direction "
            "of the command, with a common resonance and continuous state: fitted to "
            "steps, validated on held-out sweeps, compared with models that switch by "
            "other signals and with a linear model scheduled by speed.",
        ),
        (
            *drawn(
                "switched_steps",
                "Figure 8 of the paper: mean opening and closing step (closing inverted) "
                "and the models.",
                lambda: switched_figures.steps_figure(study),
            ),
            *drawn(
                "switched_held_out",
                "Figure 9 of the paper: a held-out sweep.",
                lambda: switched_figures.held_out_figure(study, context.cutoff),
            ),
        ),
        switched_claims(study),
        {HERE: _table(study.rows)} | _elsewhere(found, study),
    )


def _scheduled(found: Found) -> ScheduledFit | None:
    """Scheduled model over speed, fitted to sweeps that are not held out."""
    fitted_trials = [one for name, one in found.items() if name in _fitted(found)]
    fit = fit_scheduled(speed_trials(fitted_trials))
    return fit if isinstance(fit, ScheduledFit) else None


def _fitted(found: Found) -> list[str]:
    return [n for n in found if n.startswith("speed_") and n != f"speed_{ELSEWHERE}"]


def _elsewhere(found: Found, study: SwitchedStudy) -> dict[str, Table]:
    """Validation of the same models on the sweep at another speed, where there is one."""
    one: Identification | None = found.get(f"speed_{ELSEWHERE}")
    run = experiment_of(one) if one is not None else None
    return {THERE: _table(compare(study.rivals, [run]))} if isinstance(run, Experiment) else {}


def _table(rows: tuple[Row, ...]) -> Table:
    head = ("model", "parameters", "error in time / %", "in frequency / %", "ratio", "95 %")
    return (head, *(_cells(row) for row in rows))


def _cells(row: Row) -> tuple[str, ...]:
    low, high = row.interval
    return (
        row.name,
        str(row.parameters),
        f"{100 * row.time:.2f}",
        f"{100 * row.frequency:.2f}",
        f"{row.ratio:.3f}",
        f"{low:.3f} … {high:.3f}",
    )
