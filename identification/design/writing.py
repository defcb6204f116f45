"""A designed controller as the file that a trial runs."""

from collections.abc import Sequence

import numpy as np

from slipbench.controllers.limits import Range
from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.gains import Gains
from slipbench.identification.design.mixed import Joint, Mixture
from slipbench.identification.design.mixed_sensitivity import Synthesis
from slipbench.identification.design.problem import Answering
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

SHARE = 0.9  # of a limit of the safety gate that a controller uses: it must never trip it
FASTEST_SLIP = 0.5  # 1/s, of the reference


def controller_file(
    path: Path, designed: Designed, schedule: tuple[tuple[float, Answering], ...] = ()
) -> ControllerFile:
    """Write one actuator's controller down."""
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
        designed=_promise(path, designed),
    )


def mixed_file(spark: Path, found: Mixture, throttle: Path) -> ControllerFile:
    """Write the mixed controller down: internal models of both, and the dead zone."""
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
    promise = whole.designed | {"runs": names}
    return whole.model_copy(
        update={"name": "mixed_slip", "actuator": "mixed", "mixed": mixed, "designed": promise}
    )


def bounds(limits: Limits, actuator: str) -> Bounds:
    """Keep inside the safety gate's limits for an actuator, about its rest."""
    if actuator == "throttle":
        reach = SHARE * limits.throttle_deviation
        return Bounds(low=-reach, high=reach, rate=SHARE * limits.throttle_rate)
    low, high = (SHARE * b for b in limits.spark)
    return Bounds(low=low, high=high, rate=SHARE * limits.spark_rate)


def range_of(bounds: Bounds) -> Range:
    """Return bounds as a control law takes them."""
    return Range(bounds.low, bounds.high, bounds.rate)


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
    told = gains.controller(Range(-1.0, 1.0))
    return PidGains(
        proportional=told.proportional,
        integral=told.integral,
        derivative=told.derivative,
        filter_time=told.filter_time,
        tracking_time=told.tracking_time,
        reference_weight=told.reference_weight,
    )


def _governor(path: Path) -> GovernorTable:
    slip = Bounds(low=0.0, high=SHARE * path.limits.slip, rate=FASTEST_SLIP)
    return GovernorTable(slip=slip, gain=path.gain)


def _promise(path: Path, designed: Designed) -> dict[str, float | str]:
    worst = designed.margins.values()
    nominal = designed.margins["nominal"]
    return {
        "runs": ", ".join(path.names),
        "speed": path.speed,
        "delay": path.problem.model.delay,
        "delay_of_the_loop": path.problem.extra,
        "bandwidth_hz": designed.bandwidth,
        "complementary_hz": nominal.bandwidth,
        "rejection_hz": nominal.rejection,
        "gain_margin_db": float(20 * np.log10(min(m.gain for m in worst))),
        "phase_margin_deg": float(np.degrees(min(m.phase for m in worst))),
        "sensitivity_peak": max(m.sensitivity for m in worst),
        "robust_stability": designed.robust,
        "noise_of_the_command": designed.noise,
    }
