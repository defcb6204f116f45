"""A motorcycle at the operating point of the default trial, for tests to disturb."""

from dataclasses import replace
from typing import Any

from slipbench.bench.safety.trial import Plan, plan_of
from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.protocol.codec.messages import (
    Authority,
    EcuStatus,
    EngineStatus,
    RiderControls,
    ThrottleStatus,
)
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.trial_file import RPM, TrialFile
from tests.paths import TRIALS

OPENING = 0.09


def trial_file(**changes: Any) -> TrialFile:
    """The default throttle sweep, shortened; `excitation__stop="3 Hz"` changes one key."""
    data = load_toml(TRIALS / "throttle_sweep.toml")
    data["excitation"]["duration"] = "2 s"
    data["excitation"]["stop"] = "5 Hz"
    for path, value in changes.items():
        *tables, key = path.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return parse(data, TrialFile, where="trial.toml")


def plan(**changes: Any) -> Plan:
    trial = trial_file(**changes)
    return plan_of(trial, plan_excitation(trial))


def rider(**changes: Any) -> RiderControls:
    return replace(RiderControls(False, OPENING, 0.0, 0.0, 0.0), **changes)


def engine(**changes: Any) -> EngineStatus:
    return replace(EngineStatus(14000 * RPM, 2, 0.6, 0.0), **changes)


def vehicle_state(**changes: Any) -> VehicleState:
    """Everything as it must be for the bench to arm; the button is not pressed."""
    fine = VehicleState(
        ecu=EcuStatus(Authority.NONE, OPENING, 0.0, 0.0),
        throttle=ThrottleStatus(Authority.NONE, OPENING, 0.0, False, 0.0),
        engine=engine(),
        rider=rider(),
        speed=53.0,
        slip=0.011,
        front_slip=0.002,
        oldest_age=0.005,
        oldest="EngineStatus",
        faulty="EngineStatus",
    )
    return replace(fine, **changes)
