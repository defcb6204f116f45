"""Steps 6 and 7: rational functions with dead time, and their time response (figures 6, 7, 10)."""

from slipbench.identification.report.report import Drawn
from slipbench.identification.response.independent_lines import NoRational
from slipbench.identification.response.response import FrequencyResponse
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.context import Context, Found, response_of, runs_of
from slipbench.studies.paper.paper_section import Section, drawn
from slipbench.studies.paper.rational_claims import RationalStudy, rational_claims, time_claims
from slipbench.studies.paper.rational_figures import (
    delay_figure,
    fit_figure,
    order_figure,
    time_figure,
)
from slipbench.studies.paper.rational_trial import known_path, stretches_of, study_of

LEAST_FIT = 80.0  # % of the slip's movement that a model must follow in time
THROTTLE, SPARK = "throttle_position", "spark_command"
DELAYS = {THROTTLE: 0.010, SPARK: 0.004}  # s: the paper's, and the ignition's
Studies = dict[str, RationalStudy | NoRational]


def studies_of(found: Found, context: Context) -> Studies:
    """Study of the first run on each actuator."""
    return {
        role: study_of(
            runs_of(found, role.partition("_")[0])[0],
            role,
            delay,
            known_path(context.nominal, role, context.plus_minus),
        )
        for role, delay in DELAYS.items()
    }


def rational(found: Found, studies: Studies, context: Context) -> Section:
    """Section on orders, dead time and fit of both first harmonics."""
    paragraphs = [
        "Fitted as in the paper, by damped Gauss-Newton on the weighted distance "
        "from the first harmonic (equation 4), and by maximum likelihood with the "
        "variances of the response. Every order that is also plausible is listed.",
        *(study.reason for study in studies.values() if isinstance(study, NoRational)),
    ]
    figures: list[Drawn] = []
    claims: list[Claim] = []
    for role, study in studies.items():
        response = response_of(runs_of(found, role.partition("_")[0])[0], role)
        if isinstance(study, RationalStudy) and response is not None:
            figures += _figures(role, study, response, context.bandwidth)
            claims += rational_claims(study)
    # 4 ms of the spark turn by 17 degrees at 12 Hz: no zero is needed for that
    kept = tuple(c for c in claims if c.name != f"right_zero_without_delay_{SPARK}")
    return Section(
        "6", "Transfer functions with dead time", tuple(paragraphs), tuple(figures), kept
    )


def _figures(
    role: str, study: RationalStudy, response: FrequencyResponse, bandwidth: float
) -> tuple[Drawn, ...]:
    name = role.replace("_", " ")
    return (
        *drawn(
            f"rational_{role}",
            f"From {name} to slip: measured (markers) and fitted (lines).",
            lambda: fit_figure(response, study, bandwidth),
        ),
        *drawn(
            f"delay_{role}",
            f"What the recording knows of the delay from {name}.",
            lambda: delay_figure(study),
        ),
        *drawn(f"order_{role}", f"Orders for {name}.", lambda: order_figure(study)),
    )


def time_domain(found: Found, studies: Studies, context: Context) -> Section:
    """Section on the maximum-likelihood model simulated with the measured throttle."""
    title, study = "Time-domain check of the model", studies[THROTTLE]
    if isinstance(study, NoRational):
        return Section("7", title, (study.reason,))
    segments = stretches_of(runs_of(found, "throttle")[0], study, context.bandwidth)
    return Section(
        "7",
        title,
        (
            "The maximum-likelihood model, simulated with the measured throttle, and "
            "the measured slip.",
        ),
        drawn(
            "time_check",
            "Figure 7 of the paper: three segments of the sweep, at 0.35, 0.5 and 0.9 w_c.",
            lambda: time_figure(segments, context.bandwidth),
        ),
        time_claims(segments, LEAST_FIT),
    )
