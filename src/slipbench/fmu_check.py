"""An exported FMU compared with what it was exported from: a throttle sweep through both."""

from collections.abc import Mapping
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from slipbench.plant.fmu.model import FmuModel
    from slipbench.plant.signals import Floats

SECONDS, AMPLITUDE = 5.0, 0.02
START, RISE = 0.5, 2.3  # Hz, Hz/s: a sweep to 12 Hz, as in the trial that ships with slipbench
COMMUNICATION_STEP = 1e-3  # s
SLOW = 0.7  # Hz, of all else
SPARK, BRAKE, FORCE, GRIP = 0.05, 15.0, 60.0, 0.1  # rad, N m, N, 1
MOST = 1e-6
"""Of an output's largest value, or of 1 in its unit, by which the FMU may deviate from the plant."""


def header_folder() -> Path:
    """Return the folder of the header files of FMI, which fmpy brings. Raises InputError."""
    return Path(str(optional_library("fmpy").__file__)).parent / "c-code"


def require_valid(path: Path) -> None:
    """Check an FMU with fmpy's validation. Raises InputError, which names every fault."""
    if faults := _faults(path):
        raise InputError("the FMU is not valid", where=str(path), found="; ".join(faults))


def require_as_valid(path: Path, inner: Path) -> None:
    """Raise InputError where an FMU is invalid although the FMU inside of it is valid."""
    if not _faults(inner):
        require_valid(path)


def _faults(path: Path) -> list[str]:
    return [*optional_library("fmpy.validation").validate_fmu(str(path))]


def largest_deviation(path: Path, model: "FmuModel") -> float:
    """Ride a sweep of throttle and spark through an FMU and through the plant.

    Returns the largest difference of any output, in shares of its largest value (at least 1 in its
    unit). Raises InputError where it is above MOST.
    """
    inputs = sweep(model)
    expected, found = simulated(model, inputs), ridden(path, inputs)
    apart = {
        name: float(np.max(np.abs(found[name] - values)) / max(np.max(np.abs(values)), 1.0))
        for name, values in expected.items()
    }
    worst = max(apart, key=lambda name: apart[name])
    if not apart[worst] <= MOST:  # NaN too
        raise InputError(
            f"{worst} of the FMU deviates from the plant by {apart[worst]:.3g} of its size",
            where=str(path),
            expected=f"at most {MOST:g}",
            remedy="report it with the vehicle file, and the versions that slipbench doctor prints",
        )
    return apart[worst]


def sweep(model: "FmuModel") -> dict[str, "Floats"]:
    """Return every input by name, SI, (n,), one value a communication step.

    Throttle and spark are swept; rear brake, road force and grip move as well.
    """
    from slipbench.plant.fmu.variables import INPUT, variables

    time = COMMUNICATION_STEP * np.arange(round(SECONDS / COMMUNICATION_STEP))
    starts = {v.name: np.full(time.size, v.start) for v in variables(model) if v.kind == INPUT}
    wave = AMPLITUDE * np.sin(2.0 * np.pi * (START + 0.5 * RISE * time) * time)
    turn = 2.0 * np.pi * SLOW * time
    return {
        **starts,
        "throttle_command": np.clip(model.command + wave, 0.0, 1.0),
        "spark": SPARK * np.sin(5.0 * turn),
        "rear_brake": BRAKE * np.maximum(np.sin(turn), 0.0),
        "road_force": FORCE * np.cos(turn),
        "grip": 1.0 - GRIP * np.sin(turn) ** 2,
    }


def simulated(model: "FmuModel", inputs: Mapping[str, "Floats"]) -> dict[str, "Floats"]:
    """Return the outputs of the plant by name, SI, (n,), each at the end of a communication step."""
    from slipbench.plant.signals import Inputs
    from slipbench.plant.simulation import Outputs, Simulation

    steps = round(COMMUNICATION_STEP / model.step)
    simulation = Simulation(model.motorcycle, model.step, steps, steps)
    state = simulation.state(throttle_command=model.command, **model.initial)
    rows = next(iter(inputs.values())).size
    held = Inputs.held(rows, **inputs)
    names = [name for name in Outputs.names if name != "time"]
    return simulation.trajectories(state, held, (*names, *model.layout.effect_states))


def ridden(path: Path, inputs: Mapping[str, "Floats"]) -> dict[str, "Floats"]:
    """Return the outputs of an FMU by name, (n,), each at the end of a communication step.

    Raises InputError where a step fails.
    """
    fmpy = optional_library("fmpy")
    description = optional_library("fmpy.model_description").read_model_description(str(path))
    names = [
        v.name
        for v in description.modelVariables
        if v.causality == "output" and v.type in ("Real", "Float64")
    ]
    rows = next(iter(inputs.values())).size
    signals = np.zeros(rows, dtype=[("time", float), *((name, float) for name in inputs)])
    signals["time"] = COMMUNICATION_STEP * np.arange(rows)
    for name, values in inputs.items():
        signals[name] = values
    try:
        with redirect_stdout(StringIO()):  # fmpy prints that nothing is connected to the bus
            found = fmpy.simulate_fmu(
                str(path),
                stop_time=rows * COMMUNICATION_STEP,
                step_size=COMMUNICATION_STEP,
                output_interval=COMMUNICATION_STEP,
                input=signals,
                output=names,
                set_input_derivatives=False,
            )
    except Exception as fault:  # fmpy raises plain exceptions
        raise InputError("the FMU does not run", where=str(path), found=str(fault)) from fault
    return {name: np.asarray(found[name][1:], np.float64) for name in names}
