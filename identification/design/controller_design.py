"""Design of a slip controller from identified runs: the control law, its margins and its file.

specification = Specification("throttle", law="pid")
found = design_controller([identify(read(run)) for run in runs], specification)
write_controller(found.file, Path("throttle.toml"))
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from slipbench.identification.design import widest
from slipbench.identification.design.by_speed import scheduled
from slipbench.identification.design.from_runs import NoPath, Path, path_of
from slipbench.identification.design.h_infinity import INSTALL, h_infinity
from slipbench.identification.design.mixed import Mixture, mixture
from slipbench.identification.design.mixed_sensitivity import available
from slipbench.identification.design.problem import Problem, Requirements
from slipbench.identification.design.widest import Designed, NoDesign
from slipbench.identification.design.writing import controller_file, mixed_file
from slipbench.identification.response.identify import Identification
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError

ACTUATORS = ("throttle", "spark", "mixed")
LAWS: dict[str, Callable[[Problem], Designed | NoDesign]] = {
    "best": widest.best,
    "pid": widest.pid,
    "internal_model": widest.internal_model,
    "h_infinity": h_infinity,
}


@dataclass(frozen=True)
class Specification:
    """Specification of a design.

    actuator   "throttle", "spark" or "mixed"
    required   stability margins that every run keeps
    law        control law, a key of LAWS; "best": the better of PID and internal model
    period     s, sample time of the controller
    scheduled  gain-scheduled PID: one set of gains for the speed of each run
    """

    actuator: str
    required: Requirements
    law: str = "best"
    period: float = 0.001
    scheduled: bool = False

    def check(self) -> None:
        """Check that the choices are known and possible together. Raises InputError."""
        _check_choices(self)
        _check_period(self.period)


@dataclass(frozen=True)
class ControllerDesign:
    """Result of a design. path: design data; designed: control law and its margins."""

    path: Path
    designed: Designed
    file: ControllerFile
    law: str

    def alternatives(self) -> dict[str, Designed | NoDesign]:
        """Designs with every other control law for the same problem, for comparison."""
        own = "" if self.file.actuator == "mixed" else self.law
        others = (name for name in LAWS if name not in (own, "best"))
        return {name: LAWS[name](self.path.problem) for name in others}


def design_controller(
    runs: Sequence[Identification], specification: Specification
) -> ControllerDesign:
    """Controller with the maximum bandwidth within the margins; the first run is the nominal one.

    Raises InputError where the specification is invalid, the runs do not excite the actuator, or no
    controller keeps the margins.
    """
    specification.check()
    actuator, law = specification.actuator, specification.law
    path = _path("throttle" if actuator == "throttle" else "spark", runs, specification)
    if actuator == "mixed":
        slow = _path("throttle", runs, specification)
        both = _mixture(slow, path)
        return ControllerDesign(path, both.designed, mixed_file(path, both, slow), law)
    rows = _by_speed(runs, specification) if specification.scheduled else ()
    designed = rows[0][1] if rows else _designed(path, law)
    schedule = tuple((speed, each.controller) for speed, each in rows)
    return ControllerDesign(path, designed, controller_file(path, designed, schedule), law)


def required_margins(gain: float, phase: float, sensitivity: float) -> Requirements:
    """Stability margins of a design. gain: dB; phase: deg; sensitivity: greatest peak of S.

    Raises InputError for a margin that is not possible or not a number.
    """
    for name, value, low, high, unit in (
        ("gain margin", gain, 0.0, 60.0, "dB"),
        ("phase margin", phase, 0.0, 90.0, "deg"),
        ("sensitivity peak", sensitivity, 1.01, 100.0, "1"),
    ):
        if not low <= value <= high:
            raise InputError(
                f"the {name} is out of range",
                expected=f"{low:g} to {high:g} {unit}",
                found=f"{value:g} {unit}",
            )
    return Requirements(10 ** (gain / 20), math.radians(phase), sensitivity)


def _path(actuator: str, runs: Sequence[Identification], specification: Specification) -> Path:
    path = path_of(actuator, runs, specification.required, specification.period)
    if isinstance(path, NoPath):
        raise InputError(
            f"no controller can be designed for the {actuator}",
            found=path.reason,
            remedy=f"record a trial that excites the {actuator}",
        )
    return path


def _by_speed(
    runs: Sequence[Identification], specification: Specification
) -> tuple[tuple[float, Designed], ...]:
    """Speed (m/s) and design of each run that excited the actuator, slowest first."""
    required, period = specification.required, specification.period
    paths = [path_of(specification.actuator, [run], required, period) for run in runs]
    found = scheduled([(p.speed, p.problem) for p in paths if isinstance(p, Path)])
    if isinstance(found, NoDesign):
        raise InputError(
            "no gain schedule meets the stability margins",
            found=found.reason,
            remedy="leave out --schedule, or choose other runs",
        )
    return found.designs


def _mixture(slow: Path, fast: Path) -> Mixture:
    found = mixture(slow, fast)
    if isinstance(found, NoDesign):
        raise InputError(
            "mixed control has no advantage over the throttle alone",
            found=found.reason,
            remedy="design a controller for the throttle or the spark alone",
        )
    return found


def _designed(path: Path, law: str) -> Designed:
    found = LAWS[law](path.problem)
    if isinstance(found, NoDesign):
        raise InputError(
            "no controller meets the stability margins",
            found=found.reason,
            remedy="reduce the required margins, or use fewer operating points",
        )
    return found


def _check_choices(given: Specification) -> None:
    if given.actuator not in ACTUATORS or given.law not in LAWS:
        raise InputError(
            f"unknown actuator or control law: {given.actuator}, {given.law}",
            expected=", ".join((*ACTUATORS, *LAWS)),
            remedy="choose --actuator and --law from these",
        )
    if given.scheduled and given.actuator == "mixed":
        raise InputError(
            "a mixed controller cannot be gain-scheduled",
            found="--schedule --actuator mixed",
            expected="throttle or spark",
            remedy="leave out --schedule",
        )
    if given.actuator == "mixed" and given.law not in ("best", "internal_model"):
        raise InputError(
            "mixed control is available with internal models only",
            found=f"--law {given.law}",
            expected="best or internal_model",
            remedy="leave out --law",
        )
    if given.scheduled and given.law not in ("best", "pid"):
        raise InputError(
            "gain scheduling is available for PID only",
            found=f"--law {given.law}",
            expected="best or pid",
            remedy="leave out --law or --schedule",
        )
    if given.law == "h_infinity" and not available():
        raise InputError(
            "H-infinity design needs SLICOT",
            found="no module slycot",
            remedy=f"{INSTALL}, or choose another --law",
        )


def _check_period(period: float) -> None:
    if not 1e-4 <= period <= 1.0:
        raise InputError(
            "the sample time of the controller is out of range",
            expected="0.1 to 1000 ms",
            found=f"{period * 1e3:g} ms",
        )
