"""Claims on opening and closing, and on throttle and spark.

claims = (*switched_claims(study), *actuator_claims(compare_actuators(throttle, spark)))
"""

import numpy as np

from slipbench.identification.models.actuator_comparison import Comparison, NoComparison, answer
from slipbench.identification.models.scheduled import LeftOutSpeed, NoSchedule
from slipbench.identification.models.steps import NoSteps
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.switched_study import SwitchedStudy

INFINITE = float("inf")
UNKNOWN = float("nan")
LEAD = (45.0, 75.0)  # degrees at w_c
THROTTLE, SPARK = (0.7, 0.8), (0.8, 0.9)  # w_c, usable bandwidth


def switched_claims(study: SwitchedStudy | NoSteps) -> tuple[Claim, ...]:
    """Claims: opening and closing differ, and a switched model predicts sweeps better."""
    differ = "The responses to opening and closing differ"
    beats = "On held-out sweeps the switched model has a smaller error than the linear one"
    if isinstance(study, NoSteps):
        return (
            Claim("opening_differs", differ, UNKNOWN, 1, INFINITE, "1", "figure 8", study.reason),
            Claim("switched_beats_linear", beats, UNKNOWN, 0, 1, "1", "figure 9", study.reason),
        )
    later, half = study.switched.difference("lag")
    row = study.rows[1]
    return (
        Claim(
            "opening_differs",
            f"{differ}: difference of the lag over its 95 % half width",
            abs(later) / half,
            1,
            INFINITE,
            "1",
            "equation 5, figure 8",
            f"closing is {1e3 * later:.2f} ± {1e3 * half:.2f} ms later than opening; "
            + _constants(study),
        ),
        Claim(
            "switched_beats_linear",
            f"{beats}: upper end of the 95 % interval of the ratio of errors",
            row.interval[1],
            0,
            float(np.nextafter(1.0, 0.0)),
            "1",
            "figure 9",
            f"ratio {row.ratio:.3f}, 95 % interval {row.interval[0]:.3f} to {row.interval[1]:.3f}, "
            f"over {len(study.held_out)} sweeps",
        ),
    )


def _constants(study: SwitchedStudy) -> str:
    fit = study.switched
    sides = zip(("opening", "closing"), fit.model.directions, strict=True)
    return "; ".join(
        f"{name}: pole {1e3 * side.pole:.1f} ± {1e3 * fit.half_width(f'{name}.pole'):.1f} ms, "
        f"zero {1e3 * side.zero:.1f} ± {1e3 * fit.half_width(f'{name}.zero'):.1f} ms, "
        f"gain {side.gain:.4g} ± {fit.half_width(f'{name}.gain'):.1g}"
        for name, side in sides
    )


def actuator_claims(found: Comparison | NoComparison) -> tuple[Claim, ...]:
    """Claims on the phase lead of the spark at w_c and on both usable bandwidths."""
    known = isinstance(found, Comparison)
    lead = found.lead if isinstance(found, Comparison) else UNKNOWN
    bands = (
        [one.bandwidth / found.cutoff for one in (found.throttle, found.spark)]
        if isinstance(found, Comparison)
        else [UNKNOWN, UNKNOWN]
    )
    note = answer(found) if isinstance(found, Comparison) else found.reason
    delays = _delays(found) if isinstance(found, Comparison) else note
    margin = "phase margin of 60 degrees without dead time" if known else note
    return (
        Claim(
            "spark_leads",
            "At w_c the spark leads the throttle by about 60 degrees, without dead times",
            lead,
            *LEAD,
            "°",
            "figure 11",
            delays,
        ),
        Claim(
            "throttle_bandwidth",
            "Usable bandwidth of the throttle: 0.7 to 0.8 w_c",
            bands[0],
            *THROTTLE,
            "w_c",
            "figure 11",
            margin,
        ),
        Claim(
            "spark_bandwidth",
            "Usable bandwidth of the spark: 0.8 to 0.9 w_c",
            bands[1],
            *SPARK,
            "w_c",
            "figure 11",
            note,
        ),
    )


def _delays(found: Comparison) -> str:
    delays = [
        f"{name} {1e3 * one.delay.value:.1f} ms ({1e3 * one.delay.low:.1f} to "
        f"{1e3 * one.delay.high:.1f})"
        for name, one in (("throttle", found.throttle), ("spark", found.spark))
    ]
    return f"± {found.lead_band:.0f} degrees; dead times: {', '.join(delays)}"


def scheduled_claims(rows: tuple[LeftOutSpeed, ...] | NoSchedule) -> tuple[Claim, ...]:
    """Claim: a scheduled model predicts a held-out speed better than one model for all speeds."""
    statement = "A held-out speed is predicted better by the scheduled model than by one model for all speeds"
    if isinstance(rows, NoSchedule):
        worst, note = UNKNOWN, rows.reason
    else:
        worst = max(row.scheduled / row.constant for row in rows)
        note = "; ".join(
            f"{row.speed:.0f} m/s: {100 * row.scheduled:.1f} %, constant {100 * row.constant:.1f} %"
            for row in rows
        )
    return (
        Claim(
            "scheduled_beats_constant",
            f"{statement}: worst ratio of errors",
            worst,
            0,
            1,
            "1",
            "leave-one-speed-out cross-validation",
            note,
        ),
    )
