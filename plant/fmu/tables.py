"""tables.h of an FMU: sizes, start values, bounds and names, as the C sources read them."""

from collections.abc import Iterable, Sequence

from slipbench.plant import kernel
from slipbench.plant.fmu.bus import Bus
from slipbench.plant.fmu.bus_tables import bus_tables
from slipbench.plant.fmu.c_text import c_number
from slipbench.plant.fmu.model import FmuModel
from slipbench.plant.fmu.variables import Variable
from slipbench.plant.signals import Inputs, Outputs
from slipbench.plant.simulation import ring_length

DELAYS = {"COMMAND_DELAY": "throttle_servo_delay", "SPARK_DELAY": "engine_spark_delay"}


def tables(
    model: FmuModel, variables: Sequence[Variable], token: str, bus: Bus | None = None
) -> str:
    """Return the text of tables.h. token: by which a master names this FMU.

    Raises ValueError where frames cannot be sent at multiples of the internal step.
    """
    order = model.layout
    states, ring = len(order.states), ring_length(model.step)
    rest = Inputs.held(1).table[0]
    numbers = {
        "HEADER": kernel.HEADER,
        "RINGS": kernel.RINGS,
        "RING": ring,
        "STATES": states,
        "SIZE": kernel.HEADER + states + kernel.RINGS * ring,
        "INPUTS": len(Inputs.names),
        "OUTPUTS": len(Outputs.names) + len(order.effect_states),
        "PARAMETERS": len(order.parameters),
        "RATIOS": len(model.motorcycle.gears),
        "THROTTLE_COMMAND": kernel.THROTTLE_COMMAND,
        "SPARK": kernel.SPARK,
        **{name: order.parameters.index(key) for name, key in DELAYS.items()},
        "STEP": repr(model.step),
        "STEP_TEXT": f'"{model.step * 1e3:g} ms"',
        "TOKEN": f'"{token}"',
        "PARAMETER_STARTS": _numbers(model.parameters),
        "ROW_STARTS": _numbers(rest),
        "VARIABLES": ", ".join(map(_variable, variables)),
        **({} if bus is None else bus_tables(bus, model.step, variables)),
    }
    return "\n".join(("#include <math.h>", *(f"#define {n} {v}" for n, v in numbers.items()), ""))


def _variable(one: Variable) -> str:
    ends = ", ".join(map(c_number, (one.start, *one.bounds)))
    return f'{{{one.kind}, {one.index}, {int(one.whole)}, {ends}, "{one.name}"}}'


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(c_number(float(value)) for value in values)
