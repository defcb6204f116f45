"""The paper's identification, step by step, on recordings that came over CAN.

Corno and Savaresi, "Experimental Identification of Rear Wheel Slip Dynamics of a Motorbike", IFAC
SYSID 2009. Each step is a function from what was identified to a section with figures and claims.

    sections = paper_sections(found, Context(nominal.motorcycle, 2 * math.pi * 10))
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from identification.models.actuator_comparison import (
    Comparison,
    NoComparison,
    answer,
    compare_actuators,
)
from identification.models.model_comparison import Row
from identification.models.scheduled import ScheduledFit, Trial, fit_scheduled, leave_one_out
from identification.models.steps import NoSteps
from identification.paper import encoder_figures, filter_figures, switched_figures
from identification.paper.encoder_study import encoder_claims
from identification.paper.harmonic_claims import describing_function_claims
from identification.paper.harmonic_figures import describing_figure
from identification.paper.line_reduction import LineReductions, line_reductions, reduction_claims
from identification.paper.paper_section import Section, Table
from identification.paper.rational_claims import RationalStudy, rational_claims, time_claims
from identification.paper.rational_figures import (
    delay_figure,
    fit_figure,
    order_figure,
    time_figure,
)
from identification.paper.rational_trial import known_path, stretches_of, study_of
from identification.paper.switched_claims import actuator_claims, scheduled_claims, switched_claims
from identification.paper.switched_study import switched_study
from identification.paper.wheel_orders import order_claims
from identification.report import drawing
from identification.report.report import Drawn
from identification.response.describing_function import DescribingFunction, sliced
from identification.response.harmonics import harmonics
from identification.response.identify import Identification
from identification.response.swept_recording import swept_run_of
from identification.response.swept_run import SweptRun
from identification.signals.motion import Motion
from identification.signals.tooth_pitch import ToothPitch
from identification.signals.trial_window import TrialWindow
from plant.motorcycle import Motorcycle

LEAST_FIT = 80.0  # % of the slip's movement that a model must follow in time
DELAYS = {"throttle_position": 0.010, "spark_command": 0.004}  # s: the paper's, and the ignition's

Found = Mapping[str, Identification]


@dataclass(frozen=True)
class Context:
    """What is known beside the recordings.

    nominal    the motorcycle as its vehicle file describes it
    bandwidth  w_c, rad/s, of the throttle servo
    """

    nominal: Motorcycle
    bandwidth: float

    @property
    def cutoff(self) -> float:
        """Give w_c in Hz."""
        return self.bandwidth / (2 * math.pi)


def paper_sections(found: Found, context: Context) -> tuple[Section, ...]:
    """Go through the paper's steps in its order."""
    return tuple(step(found, context) for step in STEPS)


def runs_of(found: Found, kind: str) -> list[Identification]:
    """Give all runs of one kind: "spark" has spark_1, spark_2, ..."""
    return [one for name, one in found.items() if name.rpartition("_")[0] == kind]


def drawn(name: str, caption: str, make: Callable[[], Figure | None]) -> tuple[Drawn, ...]:
    """Draw one figure in the project's hand; nothing where it cannot be drawn."""
    with drawing.hand():
        figure = make()
    return () if figure is None else (Drawn(name, caption, figure),)


def encoder(found: Found, context: Context) -> Section:
    """Step 1: what a toothed wheel can know."""
    radius = context.nominal.rear_wheel.radius
    return Section(
        "1", "What the encoder can know",
        (
            "Between two teeth the wheel's speed is w = 2π / (N TT). More teeth are younger and "
            "less exact: the timer's microsecond weighs more in a shorter interval.",
        ),
        drawn(
            "encoder", "Error bound and delay against speed: lines by the formula, markers "
            "measured on simulated teeth. Dashed: 10 ms and 40 km/h.",
            lambda: encoder_figures.encoder(radius),
        ),
        encoder_claims(radius),
    )  # fmt: skip


def wheel_lines(found: Found, context: Context) -> Section:
    """Step 2: the line of the wheel in the spectra."""
    one = runs_of(found, "throttle")[0]
    return Section(
        "2", "Spectra, and the line of the wheel",
        (
            "Rear wheel speed, suspension travel and engine speed of one throttle sweep. What "
            "repeats with every turn of the wheel draws lines at 1X, 2X, ...; one tooth out of "
            "place draws all of them, in the wheel's speed alone.",
        ),
        drawn(
            "wheel_orders", "Amplitude spectra with the wheel's orders marked.",
            lambda: encoder_figures.orders(one),
        ),
        order_claims(one),
    )  # fmt: skip


def filtering(found: Found, context: Context) -> Section:
    """Step 3: taking the line off, and what it costs."""
    one = runs_of(found, "throttle")[0]
    lines = line_reductions(one)
    if not isinstance(lines, LineReductions) or not isinstance(one.motion, Motion):
        return Section("3", "Filtering", (f"Not shown: {lines}.",))
    speed = float(context.nominal.rear_wheel.radius * 2 * math.pi * lines.frequency)
    pitch = one.motion.pitch
    radius, teeth = context.nominal.rear_wheel.radius, one.motion.axle.teeth_per_turn or 0
    return Section(
        "3", "Filtering",
        (
            "The paper takes the line off with a low pass and a second-order notch that follows "
            "the wheel's frequency. Run both ways offline it costs no phase; online it does. "
            "Better is to learn where every tooth stands: then the wheel's speed is right from "
            "the start, all orders of the line go at once, and nothing is late.",
        ),
        (
            *drawn(
                "filtering", "A stretch of the rear wheel's speed raw, notched, and with true "
                "teeth; right: by how much each order got smaller.",
                lambda: filter_figures.filtering(one, lines),
            ),
            *drawn(
                "filter_phases", "Gain and phase of what a controller could run online.",
                lambda: filter_figures.phases(lines, speed, radius, teeth),
            ),
            *drawn(
                "teeth", "Where every tooth stands, learnt from the recording.",
                lambda: encoder_figures.teeth(pitch) if isinstance(pitch, ToothPitch) else None,
            ),
        ),
        reduction_claims(lines),
        {"Phase lag of each online filter, degrees.": _phase_table(lines)},
    )  # fmt: skip


def _phase_table(lines: LineReductions) -> Table:
    frequencies = (2.0, 5.0, 8.0, 10.0, 15.0)
    costs = filter_figures.phase_costs(lines, frequencies)
    head = ("filter", *(f"{f:g} Hz" for f in frequencies))
    return (head, *((name, *(f"{x:.1f}" for x in row)) for name, row in costs.items()))


def trials(found: Found, context: Context) -> Section:
    """Step 4: sweep and step trials."""
    throttle, steps = runs_of(found, "throttle")[0], runs_of(found, "steps")[0]
    spark, spark_steps = runs_of(found, "spark")[0], runs_of(found, "sparksteps")[0]
    return Section(
        "4", "Sweeps and steps",
        ("What was asked for, what the actuator did, and how the slip answered.",),
        (
            *drawn(
                "trials_throttle", "As the paper's figure 4: throttle.",
                lambda: switched_figures.trials_figure(throttle, steps),
            ),
            *drawn(
                "trials_spark", "The same for the spark.",
                lambda: switched_figures.trials_figure(spark, spark_steps),
            ),
        ),
    )  # fmt: skip


def describing_functions(found: Found, context: Context) -> Section:
    """Step 5: describing functions from sweeps."""
    kinds = {"throttle": "large", "spark": "spark"}
    by_kind = {name: _sweeps(runs_of(found, kind)) for name, kind in kinds.items()}
    smooth = {kind: harmonics(runs) for kind, runs in by_kind.items()}
    cut = {kind: sliced(runs) for kind, runs in by_kind.items()}
    figures: tuple[Drawn, ...] = ()
    for kind, number in (("throttle", "6"), ("spark", "10")):
        one, points = smooth[kind], cut[kind]
        if isinstance(one, DescribingFunction):
            marks = points if isinstance(points, DescribingFunction) else None
            figures += drawn(
                f"describing_functions_{kind}",
                f"As the paper's figure {number}: lines by least squares along the phase of the "
                "excitation, with 95 % bands; markers from slices.",
                lambda one=one, marks=marks: describing_figure(one, marks, context.cutoff),  # type: ignore[misc]
            )
    return Section(
        "5", "Describing functions",
        (
            "Harmonics of slip per amplitude of the echoed command, from sweeps of 5.5 % of "
            "throttle: smaller ones stay within what is linear. Markers are the paper's slices; "
            "lines use the phase of the whole sweep, from which the same recording tells more.",
        ),
        figures,
        describing_function_claims(smooth["throttle"], smooth["spark"], context.cutoff),
    )  # fmt: skip


def _sweeps(runs: list[Identification]) -> list[SweptRun]:
    made = [swept_run_of(run) for run in runs]
    return [run for run in made if isinstance(run, SweptRun)]


def rational(found: Found, context: Context) -> Section:
    """Step 6: rational functions with delay."""
    section = Section(
        "6", "Rational functions with delay",
        (
            "Fitted as in the paper, by damped Gauss-Newton on the weighted distance from the "
            "first harmonic (equation 4), and by maximum likelihood with the response's own "
            "variances. Every order that the data do not tell from the best is listed.",
        ),
    )  # fmt: skip
    for role, delay in DELAYS.items():
        kind = role.partition("_")[0]
        section = _with_study(section, runs_of(found, kind)[0], role, delay, context)
    return section


def _with_study(
    section: Section, one: Identification, role: str, delay: float, context: Context
) -> Section:
    study = study_of(one, role, delay, known_path(context.nominal, role))
    if not isinstance(study, RationalStudy):
        return Section(section.number, section.title, (*section.paragraphs, str(study)))
    response = next(r for r in one.responses if (r.input, r.output) == (role, "slip"))
    name = role.replace("_", " ")
    figures = (
        *drawn(
            f"rational_{role}", f"From {name} to slip: markers measured, lines fitted.",
            lambda: fit_figure(response, study, context.bandwidth),
        ),
        *drawn(
            f"delay_{role}", f"What the recording knows of the delay from {name}.",
            lambda: delay_figure(study),
        ),
        *drawn(f"order_{role}", f"Orders for {name}.", lambda: order_figure(study)),
    )  # fmt: skip
    claims = rational_claims(study)
    if role.startswith("spark"):  # 4 ms turn by 17 degrees at 12 Hz: no zero is needed for that
        claims = tuple(c for c in claims if not c.name.startswith("right_zero"))
    return Section(
        section.number, section.title, section.paragraphs, (*section.drawn, *figures),
        (*section.claims, *claims),
    )  # fmt: skip


def time_domain(found: Found, context: Context) -> Section:
    """Step 7: the model beside the measurement, in time."""
    one, role = runs_of(found, "throttle")[0], "throttle_position"
    study = study_of(one, role, DELAYS[role], known_path(context.nominal, role))
    if not isinstance(study, RationalStudy):
        return Section("7", "The model in time", (str(study),))
    stretches = stretches_of(one, study, context.bandwidth)
    return Section(
        "7", "The model in time",
        ("The likeliest model, driven by the measured throttle, beside the measured slip.",),
        drawn(
            "time_check", "Three stretches of the sweep, at 0.35, 0.5 and 0.9 w_c.",
            lambda: time_figure(stretches, context.bandwidth),
        ),
        time_claims(stretches, LEAST_FIT),
    )  # fmt: skip


def switched(found: Found, context: Context) -> Section:
    """Step 8: opening and closing."""
    sweeps = [*runs_of(found, "throttle"), *runs_of(found, "large")]
    study = switched_study(runs_of(found, "steps"), sweeps)
    title = "Opening differs from closing"
    if isinstance(study, NoSteps):
        return Section("8", title, (study.reason,), (), switched_claims(study))
    return Section(
        "8", title,
        (
            "A linear system whose gain, real pole and zero depend on the direction of the "
            "command, the resonance shared, its state kept at the switch: fitted on steps, "
            "judged on sweeps that it has not seen.",
        ),
        (
            *drawn(
                "switched_steps", "As the paper's figure 8: mean opening and closing step, the "
                "closing one turned over, and the models.",
                lambda: switched_figures.steps_figure(study),
            ),
            *drawn(
                "switched_held_out", "As the paper's figure 9: a held-out sweep.",
                lambda: switched_figures.held_out_figure(study, context.cutoff),
            ),
        ),
        switched_claims(study),
        {"Errors on held-out sweeps, and their ratio to the linear model's.": _rows(study.rows)},
    )  # fmt: skip


def _rows(rows: tuple[Row, ...]) -> Table:
    head = ("model", "parameters", "error in time / %", "in frequency / %", "ratio", "95 %")
    body = (
        (
            row.name,
            str(row.parameters),
            f"{100 * row.time:.2f}",
            f"{100 * row.frequency:.2f}", f"{row.ratio:.3f}",
            f"{row.interval[0]:.3f} … {row.interval[1]:.3f}",
        )
        for row in rows
    )  # fmt: skip
    return (head, *body)


def throttle_or_spark(found: Found, context: Context) -> Section:
    """Step 9: the comparison, and the answer."""
    compared = actuators(found, context)
    figures: tuple[Drawn, ...] = ()
    if isinstance(compared, Comparison):
        figures = drawn(
            "throttle_or_spark", "As the paper's figure 11: both first harmonics with their "
            "low-frequency gain taken as 1 and their pure delays taken off.",
            lambda: switched_figures.actuators_figure(compared),
        )  # fmt: skip
    return Section(
        "9", "Throttle or spark", (paper_answer(found, context),), figures,
        actuator_claims(compared),
    )  # fmt: skip


def actuators(found: Found, context: Context) -> Comparison | NoComparison:
    """Compare the first runs on throttle and on spark."""
    mains = [runs_of(found, kind)[0].main for kind in ("throttle", "spark")]
    if mains[0] is None or mains[1] is None:
        return NoComparison("a response to slip is missing")
    return compare_actuators(mains[0], mains[1], context.cutoff)


def paper_answer(found: Found, context: Context) -> str:
    """Answer the paper's question in a sentence."""
    compared = actuators(found, context)
    return answer(compared) if isinstance(compared, Comparison) else compared.reason


def scheduled(found: Found, context: Context) -> Section:
    """Beyond the paper: the model over speed, and how uncertain it is."""
    runs = [*runs_of(found, "speed"), runs_of(found, "throttle")[0]]
    trials = [
        Trial(float(np.nanmean(run.motion.reference[run.window.exciting])), run.main)
        for run in runs
        if run.main and isinstance(run.motion, Motion) and isinstance(run.window, TrialWindow)
    ]
    fit = fit_scheduled(trials)
    figures: tuple[Drawn, ...] = ()
    if isinstance(fit, ScheduledFit):
        figures = drawn(
            "scheduled", "The model over speed, with 95 % bands.",
            lambda: switched_figures.schedule_figure(fit),
        )  # fmt: skip
    return Section(
        "10", "Over speed", (f"One model for sweeps at {len(trials)} speeds in second gear.",),
        figures, scheduled_claims(leave_one_out(trials)),
    )  # fmt: skip


STEPS: tuple[Callable[[Found, Context], Section], ...] = (
    encoder, wheel_lines, filtering, trials, describing_functions, rational, time_domain,
    switched, throttle_or_spark, scheduled,
)  # fmt: skip
