"""Step 9: throttle and spark compared (figure 11), and the answer to the paper's question.

The dead times come from the recordings. That of the spark is the profile likelihood of step 6.
That of the throttle command is the sum of two: of the servo, from command to measured position, and
of the path from measured position to slip. So the servo's resonance is not estimated from slip.
"""

from slipbench.identification.models.actuator_comparison import (
    Comparison,
    DeadTime,
    NoComparison,
    answer,
    compare_actuators,
)
from slipbench.identification.models.delay_profile import DelayProfile, delay_profile
from slipbench.identification.models.model_order import all_pole, choose_order
from slipbench.identification.report.report import Drawn
from slipbench.identification.response.independent_lines import Lines, independent_lines
from slipbench.studies.paper import switched_figures
from slipbench.studies.paper.context import Context, Found, response_of, runs_of
from slipbench.studies.paper.paper_section import Section, drawn
from slipbench.studies.paper.rational_claims import RationalStudy
from slipbench.studies.paper.rational_section import SPARK, THROTTLE, Studies
from slipbench.studies.paper.switched_claims import actuator_claims

COMMAND = "throttle_command"
Compared = Comparison | NoComparison


def actuators(found: Found, studies: Studies, context: Context) -> Compared:
    """Comparison of the first run on the throttle with the first on the spark."""
    throttle, spark = (runs_of(found, kind)[0] for kind in ("throttle", "spark"))
    responses = response_of(throttle, COMMAND), response_of(spark, SPARK)
    if responses[0] is None or responses[1] is None:
        return NoComparison("a response to slip is missing")
    behind = _delay(studies, THROTTLE)
    servo = _of_servo(found)
    whole = None if behind is None or servo is None else _after(servo, behind)
    delays = whole, _delay(studies, SPARK)
    return compare_actuators(responses[0], responses[1], context.cutoff, delays)


def paper_answer(compared: Compared) -> str:
    """Answer to the paper's question in a sentence."""
    return answer(compared) if isinstance(compared, Comparison) else compared.reason


def throttle_or_spark(compared: Compared) -> Section:
    """Section with the comparison and the answer."""
    figures: tuple[Drawn, ...] = ()
    if isinstance(compared, Comparison):
        figures = drawn(
            "throttle_or_spark",
            "Figure 11 of the paper: both first harmonics normalised to a low- "
            "frequency gain of 1, without dead time.",
            lambda: switched_figures.actuators_figure(compared),
        )
    return Section(
        "9", "Throttle or spark", (paper_answer(compared),), figures, actuator_claims(compared)
    )


def _delay(studies: Studies, role: str) -> DeadTime | None:
    study = studies[role]
    profile = study.profile if isinstance(study, RationalStudy) else None
    return _dead_time(profile) if isinstance(profile, DelayProfile) else None


def _of_servo(found: Found) -> DeadTime | None:
    """Dead time from the throttle command to the measured position."""
    response = response_of(runs_of(found, "throttle")[0], COMMAND, THROTTLE)
    lines = None if response is None else independent_lines(response)
    if not isinstance(lines, Lines):
        return None
    profile = delay_profile(choose_order(lines, all_pole()))
    return _dead_time(profile) if isinstance(profile, DelayProfile) else None


def _dead_time(profile: DelayProfile) -> DeadTime:
    return DeadTime(profile.delay, profile.low, profile.high)


def _after(first: DeadTime, second: DeadTime) -> DeadTime:
    """Dead time of two paths in series; the half widths add as squares."""
    value = first.value + second.value
    below, above = (
        float(((a.value - getattr(a, end)) ** 2 + (b.value - getattr(b, end)) ** 2) ** 0.5)
        for a, b, end in ((first, second, "low"), (first, second, "high"))
    )
    return DeadTime(value, value - below, value + above)
