"""Effects and curves of one run, with their states and memories, as one record.

Compiled functions pass the record by address. As separate arrays it took 90 machine words of every
call, which cost as much as the effects themselves.
"""

import numpy as np

from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.plant.compiled import signature
from slipbench.plant.errors import PlantError
from slipbench.protocol.errors import InputError

MOST_EFFECTS = 32
"""Largest number of effects and free curves in one run."""
MOST_STATES = 512
MOST_QUANTITIES = 2048
STATES_OF_ONE = 2
"""Largest number of states of one effect."""
PARAMETERS_OF_ONE = 4
MEMORIES_OF_ONE = 4
"""Largest number of values in the memory of one effect."""
ALL_STATES = MOST_STATES + STATES_OF_ONE * MOST_EFFECTS
LAYOUT = np.dtype(
    [
        ("effects", np.int64),
        ("states", np.int64),
        ("first_state", np.int64),
        ("code", np.int64, (MOST_EFFECTS,)),
        ("where", np.int64, (MOST_EFFECTS,)),
        ("other", np.int64, (MOST_EFFECTS,)),
        ("par", np.float64, (MOST_EFFECTS, PARAMETERS_OF_ONE)),
        ("memory", np.float64, (MOST_EFFECTS, MEMORIES_OF_ONE)),
        ("x", np.float64, (ALL_STATES,)),
        ("dx", np.float64, (ALL_STATES,)),
        ("q", np.float64, (MOST_QUANTITIES,)),
        ("spill", np.float64, (MOST_STATES,)),
    ],
    align=True,
)
"""effects: number of effects. states: number of states of the system; the states of effects follow
them in x, and the rates of both are in dx. first_state: index of the first state among the
quantities q. code, where, other: library code, index of the place and index of the other quantity
of each effect. par: its parameters. spill: rates that effects add to states of the system.
"""
TABLES = "f8[:,:,::1]"
AT = signature("f8", "i8", "f8", "f8", "f8", "f8", "i8", LAYOUT, TABLES, TABLES, "i8", "f8")
LINE, ROWS = "f8[::1]", "f8[:,::1]"
ADVANCE = signature(
    "f8", LINE, ROWS, ROWS, LINE, ROWS, LINE, [LAYOUT], TABLES, "i8", "f8", "i8", ROWS
)


def board(
    code: np.ndarray, where: np.ndarray, other: np.ndarray, par: np.ndarray, states: int, first: int
) -> np.ndarray:
    """Return a record, (1,). code, where, other: (effects,), par: (effects, 4).

    states: number of states of the system; first: index of the first of them among the quantities.
    Raises PlantError for too many effects.
    """
    if len(code) > MOST_EFFECTS:
        raise PlantError(
            "too many effects and free curves act",
            "the model file",
            f"at most {MOST_EFFECTS}",
            str(len(code)),
            "leave some out",
        )
    run_record = np.zeros(1, LAYOUT)
    run_record["effects"], run_record["states"], run_record["first_state"] = (
        len(code),
        states,
        first,
    )
    for name, values in (("code", code), ("where", where), ("other", other), ("par", par)):
        run_record[name][0, : len(code)] = values
    return run_record


def check_size(e: Equations, where: str) -> None:
    """Raise InputError for a system that is too large. where: its name, for messages."""
    quantities = 1 + 2 * len(e.inputs) + len(e.seams) + 2 * len(e.states)
    for kind, count, limit in (
        ("states", len(e.states), MOST_STATES),
        ("inputs, seams and states", quantities, MOST_QUANTITIES),
    ):
        if count > limit:
            raise InputError(
                f"the system has too many {kind}",
                where=where,
                expected=f"at most {limit}",
                found=str(count),
                remedy="explain it as an FMU or as a Python function",
            )
