"""Claims on rational transfer functions with dead time.

found = rational_study(response, delay=0.010, KnownPath(lags=(0.003,)))
claims = (*rational_claims(found), *time_claims(segments, least=85.0))
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.delay_profile import (
    DelayProfile,
    NoDelay,
    delay_profile,
    felt_right_zeros,
)
from slipbench.identification.models.model_order import (
    NATS,
    OrderChoice,
    Row,
    all_pole,
    choose_order,
)
from slipbench.identification.models.rational_ml import ACROSS, RationalFit
from slipbench.identification.models.rational_paper import PaperFit, choose_paper_order
from slipbench.identification.models.time_check import NoStretch, Stretch
from slipbench.identification.response.independent_lines import (
    KnownPath,
    Lines,
    NoRational,
    independent_lines,
    without,
)
from slipbench.identification.response.response import FrequencyResponse
from slipbench.studies.paper.claims import Claim

INFINITE = float("inf")
NOTHING = KnownPath()
CLOSE = 1.0  # ms, of a delay that is found


@dataclass(frozen=True)
class RationalStudy:
    """One response, analysed as in the paper and by maximum likelihood.

    delay         s, taken as known in the paper; known: other prior knowledge of the path
    with_delay    orders by the paper's method with the known dead time; without_delay: with none
    likely        orders by maximum likelihood, dead time free
    profile       profile likelihood of the dead time of an all-pole model, known path included
    plain_profile the same without prior knowledge
    """

    lines: Lines
    delay: float
    known: KnownPath
    with_delay: OrderChoice[PaperFit]
    without_delay: OrderChoice[PaperFit]
    likely: OrderChoice[RationalFit]
    profile: DelayProfile | NoDelay
    plain_profile: DelayProfile | NoDelay


def rational_study(
    response: FrequencyResponse, delay: float, known: KnownPath = NOTHING
) -> RationalStudy | NoRational:
    """Study of a first harmonic. delay: s, dead time known from the vehicle."""
    lines = independent_lines(response)
    if isinstance(lines, NoRational):
        return lines
    plain = delay_profile(choose_order(lines, all_pole()))
    profile = plain
    if known != NOTHING:
        rest = choose_order(without(lines, known), all_pole())
        profile = delay_profile(rest, doubt=known.doubt)
    return RationalStudy(
        lines,
        delay,
        known,
        choose_paper_order(lines, delay),
        choose_paper_order(lines, 0.0),
        choose_order(lines),
        profile,
        plain,
    )


def rational_claims(study: RationalStudy) -> tuple[Claim, ...]:
    """Claims: minimum phase with the dead time, a right-half-plane zero without it, and its value."""
    name = study.lines.input
    poles = _poles_that_suffice(study)
    ms = 1e3 * study.delay
    return (
        Claim(
            f"minimum_phase_with_delay_{name}",
            f"With its dead time of {ms:.0f} ms the first harmonic from {name} is minimum phase",
            _needed_zeros(study.with_delay, study, poles),
            0,
            0,
            "zeros",
            "equation 4, figure 6",
            _orders_in_words(study.with_delay),
        ),
        Claim(
            f"right_zero_without_delay_{name}",
            f"Without dead time the first harmonic from {name} needs a zero in the right half plane",
            _needed_zeros(study.without_delay, study, poles),
            1,
            INFINITE,
            "zeros",
            "equation 4, figure 6",
            f"orders of at most {poles} poles, as suffice with the delay",
        ),
        *_delay_claims(study),
        _whiteness(study),
    )


def time_claims(segments: tuple[Stretch | NoStretch, ...], least: float) -> tuple[Claim, ...]:
    """Claims on the simulated response to the measured input. least: minimum NRMSE fit, %."""
    return tuple(
        Claim(
            f"time_check_{s.frequency:g}_Hz",
            f"NRMSE fit of the model where the sweep passes {s.frequency:g} Hz",
            s.fit if isinstance(s, Stretch) else float("nan"),
            least,
            100,
            "%",
            "figure 7",
            "" if isinstance(s, Stretch) else s.reason,
        )
        for s in segments
    )


def _delay_claims(study: RationalStudy) -> tuple[Claim, ...]:
    true = 1e3 * study.delay
    name, profile = study.lines.input, study.profile
    if isinstance(profile, NoDelay):
        found, low, high, note = float("nan"), float("nan"), float("nan"), profile.reason
    else:
        found, low, high = 1e3 * profile.delay, 1e3 * profile.low, 1e3 * profile.high
        note = f"95 % interval {low:.1f} to {high:.1f} ms; {_knowledge(study)}"
    off = max(low - true, true - high, 0.0) if np.isfinite(found) else float("nan")
    half = float(np.hypot(CLOSE, 1e3 * ACROSS * study.known.doubt))
    beside = ", in addition to the tolerance of the vehicle file" if study.known.doubt else ""
    return (
        Claim(
            f"delay_{name}",
            f"The recording determines the dead time from {name} within 1 ms{beside}",
            found,
            true - half,
            true + half,
            "ms",
            "profile likelihood of the dead time",
            note,
        ),
        Claim(
            f"delay_interval_{name}",
            "The 95 % interval of the dead time contains the true one",
            off,
            0,
            0,
            "ms outside",
            "profile likelihood",
            note,
        ),
    )


def _whiteness(study: RationalStudy) -> Claim:
    best = study.likely.best.fit
    return Claim(
        f"chi_square_{study.lines.input}",
        "The residual of the model is noise: chi-square per degree of freedom",
        best.chi_square_ratio,
        0.4,
        1.6,
        "1",
        "maximum likelihood",
        f"{best.order}, {best.freedom} degrees of freedom",
    )


def _poles_that_suffice(study: RationalStudy) -> int:
    """Poles of the first order within 2 nats of the best that is minimum phase with the dead time."""
    rows = study.with_delay.within()
    right = [row for row in rows if not _felt(row, study)]
    return (right or list(rows))[0].order.poles


def _needed_zeros(table: OrderChoice[PaperFit], study: RationalStudy, poles: int) -> float:
    """Fewest right-half-plane zeros of the orders with so many poles that are not rejected."""
    rows = [row for row in table.rows if row.order.poles <= poles]
    if not rows:
        return float("nan")
    return float(min(_felt(row, study) for row in rows if row.nats <= rows[0].nats + NATS))


def _felt(row: Row[PaperFit], study: RationalStudy) -> int:
    return int(felt_right_zeros(row.fit.model, float(study.lines.frequency[-1])).size)


def _orders_in_words(table: OrderChoice[PaperFit]) -> str:
    within = "; ".join(str(row.order) for row in table.within())
    return f"order by FPE {table.best_by_fpe.order}; within 2 nats: {within}"


def path_in_words(known: KnownPath) -> str:
    """Prior knowledge of a path as text."""
    parts = [("lag", lag) for lag in known.lags] + [("lead", lead) for lead in known.leads]
    parts += [("instruments' delay", known.delay)] if known.delay else []
    text = ", ".join(f"{what} {1e3 * size:.3g} ms" for what, size in parts)
    return text + (
        f" (95 %: {1e3 * ACROSS * known.doubt:.2g} ms either way)" if known.doubt else ""
    )


def _knowledge(study: RationalStudy) -> str:
    if study.known == NOTHING:
        return "nothing of the path taken as known"
    p = study.plain_profile
    plain = (
        p.reason
        if isinstance(p, NoDelay)
        else f"{1e3 * p.delay:.1f} ms, {1e3 * p.low:.1f} to {1e3 * p.high:.1f}"
    )
    return f"taken as known: {path_in_words(study.known)}; without that {plain}"
