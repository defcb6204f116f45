"""Small parts of the kernel whose length depends on how many states and parameters there are.

Numbers travel through the kernel as tuples, which the compiler keeps in registers; a loop over an
array would cost as much as the physics.
"""

from slipbench.plant.equations import RATES
from slipbench.plant.layout import Layout
from slipbench.plant.signals import Inputs, Outputs

LED = ("throttle", "engine_speed", "rear_speed", "speed")
ELSEWHERE = ("throttle_command", "spark", "gear", *(f"measured_{state}" for state in LED))
HELD = ("gear_ratio", *(name for name in Inputs.names if name not in ELSEWHERE))


def tuple_texts(order: Layout) -> list[str]:
    """The texts of the kernel's small functions, written out for the number of states."""
    n, outputs = len(order.states), len(Outputs.names) + len(order.effect_states)
    return [
        _tuple_text("along(x, h, k)", "x[{0}] + h * k[{0}]", n),
        _tuple_text("past_middle(x, h, k1, k2)", "x[{0}] + h * (2.0 * k2[{0}] - k1[{0}])", n),
        _tuple_text("mean_rate(a, b, c)", "(a[{0}] + 4.0 * b[{0}] + c[{0}]) / 6.0", n),
        _tuple_text("read_states(x)", "x[{0}]", n),
        _tuple_text("read_parameters(p)", "p[{0}]", len(order.parameters)),
        _inputs_text(),
        _throttle_text(n),
        _slopes_text(),
        _write_text("write", outputs),
        _write_text("write_states", n),
    ]


def _tuple_text(head: str, element: str, length: int) -> str:
    return f"def {head}:\n    return ({', '.join(element.format(i) for i in range(length))},)"


def _inputs_text() -> str:
    given = {"gear_ratio": "ratio", "clutch": "clutch"}
    places = {name: f"row[{i}]" for i, name in enumerate(Inputs.names)}
    elements = ", ".join(given.get(name) or places[name] for name in HELD)
    return f"def read_inputs(row, ratio, clutch):\n    return ({elements},)"


def _throttle_text(states: int) -> str:
    others = ", ".join(f"x[{i}]" for i in range(2, states))
    return f"def with_throttle(x, position, rate):\n    return (position, rate, {others})"


def _slopes_text() -> str:
    places = ((Inputs.names.index(f"measured_{s}"), list(RATES).index(s)) for s in LED)
    elements = ", ".join(f"(row[{column}] - x[{state}]) / duration" for column, state in places)
    return f"def slopes(row, x, duration):\n    return ({elements},)"


def _write_text(name: str, length: int) -> str:
    lines = "\n".join(f"    row[{i}] = numbers[{i}]" for i in range(length))
    return f"def {name}(row, numbers):\n{lines}"
