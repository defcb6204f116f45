"""Export of a controller to an engine control unit: the law and its limits, reducing only.

The rider's throttle and the engine's timing are the upper limits, as in the scenarios with high
throttle. Governor and prefilter shape a setpoint that moves; here it is constant, so both stay out.
"""

from dataclasses import dataclass
from typing import Any

from slipbench.controllers.slip_controller import SlipController, from_tree
from slipbench.identification.closed_loop_simulation.reducing import reducing_tree
from slipbench.identification.ecu.rusefi import FASTEST
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError

WHOLE = 1e-6  # of a period, by which a tick may differ from whole periods
LARGEST_TARGET = 0.5  # slip


@dataclass(frozen=True)
class ExportedLaw:
    """file: as designed; target: slip above which it reduces; tick_rate: Hz, of the control unit."""

    file: ControllerFile
    target: float
    tick_rate: float = FASTEST

    @property
    def tree(self) -> dict[str, Any]:
        """Numbers of the exported controller, as in a controller file."""
        return {**reducing_tree(self.file), "prefilter": ()}

    @property
    def controller(self) -> SlipController:
        """The same controller for simulation and comparison."""
        return from_tree(self.tree)

    @property
    def tick(self) -> float:
        """Time between two ticks of the control unit, s."""
        return 1.0 / self.tick_rate

    @property
    def periods(self) -> int:
        """Periods of the controller in a tick."""
        return round(self.tick / self.file.period)


def exported_law(
    file: ControllerFile, target: float, tick_rate: float, where: str = ""
) -> ExportedLaw:
    """Check what is exported. Raises InputError where the control unit cannot run it."""
    law = ExportedLaw(file, target, tick_rate)
    _check_target(target)
    if not 1.0 <= tick_rate <= FASTEST:
        raise InputError(
            "rusEFI cannot tick so",
            where="--tick",
            expected=f"1 to {FASTEST:g} Hz",
            found=f"{tick_rate:g} Hz",
        )
    if abs(law.tick / file.period - max(law.periods, 1)) > WHOLE:
        raise InputError(
            "a tick of the control unit is no whole number of the controller's periods",
            where=where,
            expected=f"period: {1000 * law.tick:g} ms, or a whole fraction of it",
            found=f"{1000 * file.period:g} ms",
            remedy=f"slipbench design RUN... --period {1000 * law.tick:g}, or another --tick",
        )
    _check_reduces(file, where)
    return law


def _check_target(target: float) -> None:
    if not 0.0 < target <= LARGEST_TARGET:
        raise InputError(
            "no slip to hold",
            where="--target",
            expected=f"slip above 0, at most {LARGEST_TARGET:g}: 0.03 is 3 %",
            found=f"{target:g}",
        )


def _check_reduces(file: ControllerFile, where: str) -> None:
    tables = {"limits": file.limits}
    if file.mixed:
        tables["mixed.throttle"] = file.mixed.throttle
    for name, bounds in tables.items():
        if bounds.low >= 0.0:
            raise InputError(
                "this controller cannot reduce the torque",
                where=f"{where}: {name}.low",
                expected="below 0",
                found=f"{bounds.low:g}",
            )
