"""How fast the motorcycle runs: `python tests/plant/benchmark.py` from the project's folder.

Reports medians of several runs; asserts nothing, because a shared machine is no clock.
"""

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from slipbench.plant.composition import compose
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.layout import moving
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import builtin_vehicle

Library = tuple[type[Effect], ...]

ROWS = 1000
ROUNDS = 40


def seconds(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def record(motorcycle: Motorcycle, every: int, library: Library) -> Callable[[], object]:
    simulation = Simulation(motorcycle, every=every, library=library)
    state, throttle = equilibrium(simulation, 2, 1466.0)
    inputs = Inputs.held(ROWS, gear=2.0, throttle_command=throttle)
    return lambda: simulation.advance(state, inputs)


def per_call(motorcycle: Motorcycle) -> float:
    """Microseconds for one row, with filling the input and reading an output."""
    simulation = Simulation(motorcycle, every=4)
    state, throttle = equilibrium(simulation, 2, 1466.0)
    row = Inputs.held(1, gear=2.0, throttle_command=throttle)

    def second() -> float:
        now, speed = state, 0.0
        for _ in range(1000):
            row.throttle_command[0] = throttle
            now, out = simulation.advance(now, row)
            speed = out.speed[0]
        return speed

    return 1e3 * statistics.median(seconds(second) for _ in range(9))


def report(runs: dict[str, Callable[[], object]]) -> None:
    """Take turns, so that a disturbance of the machine falls on all alike."""
    taken: dict[str, list[float]] = {title: [] for title in runs}
    for _ in range(ROUNDS):
        for title, run in runs.items():
            taken[title].append(1e9 * seconds(run) / (4 * ROWS))
    for title, steps in taken.items():
        middle, best = statistics.median(steps), min(steps)
        print(f"{title:52} {middle:4.0f} ns a step (best {best:4.0f}), ", end="")
        print(f"{0.25e6 / middle:5.0f} x real time (best {0.25e6 / best:5.0f})")


def main() -> None:
    nominal = load_vehicle(builtin_vehicle("nominal")).motorcycle
    demonstration = load_vehicle(builtin_vehicle("demonstration")).motorcycle
    absent = Motorcycle(effects=tuple(effect.absent() for effect in LIBRARY))
    own = tuple(type(effect) for effect in demonstration.effects)
    inside = moving(LIBRARY)
    ready = seconds(lambda: compose(inside))
    print(f"kernel with {len(inside)} effects of {len(LIBRARY)}: {ready:.1f} s to be ready")
    report(
        {
            "nominal, no effect in the kernel": record(nominal, 1, ()),
            "nominal": record(nominal, 1, LIBRARY),
            "nominal, a sample a millisecond": record(nominal, 4, LIBRARY),
            "all effects, each at absent()": record(absent, 1, LIBRARY),
            "demonstration": record(demonstration, 1, LIBRARY),
            "demonstration, a sample a millisecond": record(demonstration, 4, LIBRARY),
            "demonstration, only its own effects in the kernel": record(demonstration, 1, own),
        }
    )
    print(f"one row of 4 steps from Python: {per_call(demonstration):.1f} us a call")


if __name__ == "__main__":
    main()
