"""tables.h of a wrapper: signals, effects and start values for the C sources."""

import json
import platform
from collections.abc import Iterable, Sequence
from itertools import starmap

from slipbench.identification.mismatch.callables.fmu.plan import Plan, to_fmu_units
from slipbench.identification.mismatch.callables.fmu.steps import MOST_EVENTS, TOLERANCE
from slipbench.identification.mismatch.callables.fmu.variables import Port
from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Side, Sides
from slipbench.identification.mismatch.callables.fmu.wrapper.sizes import EffectSize, effect_sizes
from slipbench.identification.mismatch.callables.simulator import written
from slipbench.identification.mismatch.systems.board import (
    ALL_STATES,
    LAYOUT,
    MEMORIES_OF_ONE,
    MOST_EFFECTS,
    MOST_QUANTITIES,
    MOST_STATES,
    PARAMETERS_OF_ONE,
    STATES_OF_ONE,
)
from slipbench.identification.mismatch.systems.run import MOST_RING
from slipbench.plant.errors import PlantError
from slipbench.plant.fmu.c_text import c_number
from slipbench.plant.fmu.library import SUFFIXES
from slipbench.protocol.errors import InputError

MOST_INDICATORS = 1000
MOST_ITERATIONS = 100
INNER_FOLDERS = {
    ("2.0", "Linux"): ("linux64",),
    ("2.0", "Darwin"): ("darwin64",),
    ("3.0", "Linux"): (f"{platform.machine()}-linux",),
    ("3.0", "Darwin"): (f"{platform.machine().replace('arm64', 'aarch64')}-darwin",),
}


def tables(sides: Sides, token: str) -> str:
    """Return the text of tables.h. token: GUID or instantiation token of the wrapper."""
    plan, file = sides.opened.plan, sides.opened.model
    signal_count, description = len(file.outputs) + len(file.states), plan.fmu.description
    sizes, calibrated = effect_sizes(sides), calibrated_values(sides)
    own_token = description.guid if plan.fmu.version == "2.0" else description.instantiationToken
    acting = max(len(s.effects) for s in (sides.inputs, sides.rates, sides.outputs))
    numbers = {
        "TOKEN": _text(token),
        "INNER_TOKEN": _text(str(own_token)),
        "INNER_LIBRARY": _text(inner_library(plan)),
        "MODEL_EXCHANGE": int(plan.interface == "model_exchange"),
        "STATE_COUNT": len(description.derivatives),
        "INDICATOR_COUNT": int(description.numberOfEventIndicators or 0),
        "INNER_STEP": repr(plan.step),
        "STEP": repr(file.step),
        "INPUT_PARTS": sides.inputs.parts,
        "OUTPUT_PARTS": sides.outputs.parts,
        "INPUTS": len(file.inputs),
        "OUTPUTS": len(file.outputs),
        "SHOWN": signal_count,
        "NAMED_STATES": len(file.states),
        "MOST_VALUES": len(file.inputs) + signal_count + STATES_OF_ONE * acting + 1,
        "OWN_STATES": STATES_OF_ONE,
        "MOST_EFFECTS": MOST_EFFECTS,
        "MOST_STATES": MOST_STATES,
        "ALL_STATES": ALL_STATES,
        "MOST_QUANTITIES": MOST_QUANTITIES,
        "MOST_PARAMETERS": PARAMETERS_OF_ONE,
        "MOST_MEMORIES": MEMORIES_OF_ONE,
        "BOARD_BYTES": LAYOUT.itemsize,
        "MOST_RING": MOST_RING,
        "MOST_INDICATORS": MOST_INDICATORS,
        "MOST_ITERATIONS": MOST_ITERATIONS,
        "MOST_EVENTS": MOST_EVENTS,
        "TOLERANCE": repr(TOLERANCE),
        **_side("INPUT", sides.inputs),
        **_side("RATE", sides.rates),
        **_side("OUTPUT", sides.outputs),
        **_evaluated_points(sides),
        "INPUT_PORTS": _ports(plan.inputs),
        "OUTPUT_PORTS": _ports(plan.outputs[: len(file.outputs)]),
        "STATE_PORTS": _ports(tuple(state.port for state in plan.states)),
        "STATE_INDICES": _row(state.index for state in plan.states),
        "INPUT_STARTS": _row(_starts(plan)),
        "LATE_STARTS": _row(_delays(sides)),
        "CALIBRATED_COUNT": len(calibrated),
        "CALIBRATED_REFERENCES": _row(calibrated),
        "CALIBRATED_VALUES": _row(calibrated.values()),
        "EFFECT_PARAMETER_COUNT": len(sizes),
        "EFFECT_PARAMETERS": ", ".join(starmap(_size, enumerate(sizes, first_reference(sides))))
        or '{0, 0, 0, 0.0, 0.0, 0.0, ""}',
    }
    return "\n".join(("#include <math.h>", *(f"#define {n} {v}" for n, v in numbers.items()), ""))


def calibrated_values(sides: Sides) -> dict[int, float]:
    """Return the calibrated parameters, in units of the FMU, by value reference."""
    plan, system = sides.opened.plan, sides.opened.system
    values = to_fmu_units(plan.parameters, written(system.file, system.values))
    return {p.reference: float(v) for p, v in zip(plan.parameters, values, strict=True)}


def first_reference(sides: Sides) -> int:
    """Return the value reference of the first effect parameter: after those of the FMU."""
    variables = sides.opened.plan.fmu.description.modelVariables
    return 1 + max(int(v.valueReference) for v in variables)


def inner_library(plan: Plan) -> str:
    """Return the path of the FMU's library, relative to its binaries folder. Raises InputError."""
    system = platform.system()
    for folder in INNER_FOLDERS.get((plan.fmu.version, system), ()):
        name = f"{folder}/{plan.identifier}{SUFFIXES[system]}"
        if (plan.fmu.folder / "binaries" / name).exists():
            return name
    raise InputError(
        "an FMU is wrapped on the platform for which it was made",
        where=str(plan.fmu.path),
        expected=", ".join(SUFFIXES),
        found=f"no binary of FMI {plan.fmu.version} for {system} on {platform.machine()}",
    )


def _side(name: str, side: Side) -> dict[str, object]:
    return {
        f"{name}_EFFECTS": len(side.effects),
        f"{name}_CODES": _row(side.code.tolist()),
        f"{name}_PLACES": _row(side.where.tolist()),
        f"{name}_OTHERS": _row(side.other.tolist()),
        f"{name}_DELAYS": _row(side.delays),
        f"{name}_SIZES": _row(side.par.ravel().tolist()),
    }


def _evaluated_points(sides: Sides) -> dict[str, object]:
    """Return the injection points evaluated on each side, and the source signals of the outputs."""
    file = sides.opened.model
    inputs, outputs = len(file.inputs), len(file.outputs)
    first_output = inputs + outputs + len(file.states)
    rate_points = sorted(set(sides.rates.where.tolist()))
    return {
        "RATES_ACTED": len(rate_points),
        "INPUT_TOLD": _row(range(inputs)),
        "RATE_TOLD": _row(rate_points),
        "OUTPUT_TOLD": _row(first_output + k for k in range(outputs)),
        "OUTPUT_SOURCES": _row(inputs + k for k in range(outputs)),
    }


def _starts(plan: Plan) -> Iterable[float]:
    """Return the start values of the inputs, SI."""
    return (port.start for port in plan.inputs)


def _delays(sides: Sides) -> Iterable[float]:
    for name in sides.opened.model.outputs:
        yield next(iter(sides.late[name].values())) if name in sides.late else 0.0


def _size(reference: int, one: EffectSize) -> str:
    numbers = ", ".join(map(c_number, (one.value, *one.bounds)))
    return f"{{{reference}, {one.side}, {one.index}, {numbers}, {_text(one.name)}}}"


def _ports(ports: Sequence[Port]) -> str:
    rows = (f"{{{p.reference}, {p.slope!r}, {p.offset!r}}}" for p in ports)
    return ", ".join(rows) or "{0, 1.0, 0.0}"


def _row(values: Iterable[float]) -> str:
    """Return numbers separated by commas; "0" where empty, since C has no empty arrays."""
    return ", ".join(map(c_number, values)) or "0"


def _text(value: str) -> str:
    if not value.isascii():
        raise PlantError(
            "a name in the FMU is not ASCII", "export-fmu", "ASCII", value, "rename it"
        )
    return json.dumps(value)
