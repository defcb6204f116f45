"""Controller file of a design, as a trial uses it."""

from collections.abc import Sequence

import numpy as np

from slipbench.controllers.limits import Range
from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.gains import Gains
from slipbench.identification.design.mixed import Joint, Mixture
from slipbench.identification.design.mixed_sensitivity import Synthesis
from slipbench.identification.design.problem import LinearController
from slipbench.identification.design.shaping import Shape
from slipbench.identification.design.widest import Designed
from slipbench.protocol.controller_file import (
    Bounds,
    ControllerFile,
    GovernorTable,
    Law,
    LinearSections,
    Mixed,
    ModelSections,
    PidGains,
    ScheduledGains,
    SectionRow,
)
from slipbench.protocol.trial_file import Limits

SHARE = 0.9  # of the safety gate's limits that a controller may use, so that it never trips
FASTEST_SLIP = 0.5  # 1/s, of the reference


def controller_file(
    path: Path, designed: Designed, schedule: tuple[tuple[float, LinearController], ...] = ()
) -> ControllerFile:
    """Controller file of a design for one actuator. schedule: (speed in m/s, PID)."""
    return ControllerFile(
        name=f"{path.actuator}_slip",
        actuator="throttle" if path.actuator == "throttle" else "spark",
        period=path.problem.period,
        law=_law(designed),
        limits=bounds(path.limits, path.actuator),
        schedule=tuple(
            ScheduledGains(speed=v, gains=_pid(g)) for v, g in schedule if isinstance(g, Gains)
        ),
        governor=_governor(path),
        prefilter=(designed.prefilter.section,),
        designed=_figures(path, designed),
    )


def mixed_file(spark: Path, found: Mixture, throttle: Path) -> ControllerFile:
    """Controller file of a mixed design: internal models of both actuators and the dead zone."""
    whole = controller_file(spark, found.designed)
    mixed = Mixed(
        law=_sections(found.joint.throttle),
        throttle=bounds(throttle.limits, "throttle"),
        later=_rows(found.joint.later),
        delay=found.joint.delay,
        zone=found.zone,
        exchange=found.joint.exchange,
    )
    names = ", ".join((*throttle.names, *spark.names))
    figures = whole.designed | {"runs": names}
    return whole.model_copy(
        update={"name": "mixed_slip", "actuator": "mixed", "mixed": mixed, "designed": figures}
    )


def bounds(limits: Limits, actuator: str) -> Bounds:
    """Command limits of an actuator relative to its rest position, inside the safety gate's."""
    if actuator == "throttle":
        half_range = SHARE * limits.throttle_deviation
        return Bounds(low=-half_range, high=half_range, rate=SHARE * limits.throttle_rate)
    low, high = (SHARE * b for b in limits.spark)
    return Bounds(low=low, high=high, rate=SHARE * limits.spark_rate)


def _law(designed: Designed) -> Law:
    if isinstance(designed.controller, Gains):
        return _pid(designed.controller)
    if isinstance(designed.controller, Synthesis):
        return _linear(designed.controller)
    law = designed.controller
    shape = law.spark if isinstance(law, Joint) else law
    assert isinstance(shape, Shape)
    return _sections(shape)


def _sections(shape: Shape) -> ModelSections:
    model, inverse = _rows(shape.model), _rows(shape.inverse)
    return ModelSections(model=model, inverse=inverse, delay=shape.delay)


def _linear(found: Synthesis) -> LinearSections:
    return LinearSections(
        integral=found.integral, shaping=_rows(found.shaping), tracking_time=found.tracking_time
    )


def _rows(sections: Sequence[Sequence[float]]) -> tuple[SectionRow, ...]:
    return tuple((float(a), float(b), float(c), float(d), float(e)) for a, b, c, d, e in sections)


def _pid(gains: Gains) -> PidGains:
    pid = gains.controller(Range(-1.0, 1.0))
    return PidGains(
        proportional=pid.proportional,
        integral=pid.integral,
        derivative=pid.derivative,
        filter_time=pid.filter_time,
        tracking_time=pid.tracking_time,
        reference_weight=pid.reference_weight,
    )


def _governor(path: Path) -> GovernorTable:
    slip = Bounds(low=0.0, high=SHARE * path.limits.slip, rate=FASTEST_SLIP)
    return GovernorTable(slip=slip, gain=path.gain)


def _figures(path: Path, designed: Designed) -> dict[str, float | str]:
    worst = designed.margins.values()
    nominal = designed.margins["nominal"]
    return {
        "runs": ", ".join(path.names),
        "speed": path.speed,
        "delay": path.problem.model.delay,
        "loop_delay": path.problem.extra,
        "bandwidth_hz": designed.bandwidth,
        "complementary_hz": nominal.bandwidth,
        "rejection_hz": nominal.rejection,
        "gain_margin_db": float(20 * np.log10(min(m.gain for m in worst))),
        "phase_margin_deg": float(np.degrees(min(m.phase for m in worst))),
        "sensitivity_peak": max(m.sensitivity for m in worst),
        "robust_stability": designed.robust,
        "command_noise": designed.noise,
    }
