"""Which tangents a run needs: those that a column reaches and that an output depends on."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.equations import RATES
from slipbench.plant.kernel_parts import LED
from slipbench.plant.signals import Inputs
from slipbench.plant.tangent_rows import COPIED, HISTORY_OF, Rows, Source


@dataclass(frozen=True)
class Reach:
    """live: numbers of the states that have tangents; wanted: by equation, whether the rates, the
    outputs, or either of them need its tangents, shape (3, equations); rows: offset of each shown
    output's tangents, or -1.
    """

    live: NDArray[np.int64]
    wanted: NDArray[np.bool_]
    rows: NDArray[np.int64]


def reach(
    rows: Rows,
    present: Iterable[str],
    columns: Iterable[Source],
    led: Iterable[str],
    shown: Iterable[str],
) -> Reach:
    """Find the states, equations and outputs whose tangents a run needs.

    present: names of the effects; columns: what has tangents of its own; led: states that are
    prescribed from beginning to end; shown: names of outputs.
    """
    graph = _graph(rows, frozenset(present))
    order = rows.order.states
    free = [i for i, state in enumerate(order) if state not in set(led)]
    active = _active(graph, columns, free)
    outputs = [rows.output(name) for name in shown]
    of_outputs = _behind(graph, {source for source in outputs if source})
    of_rates: set[Source] = set()
    states: set[int] = set()
    while (found := _states(of_outputs | of_rates)) != states:
        states = found
        of_rates = _behind(graph, {("rate", i) for i in states if i in free})
    wanted = [
        [bool(gives & active & need) for _, gives in graph] for need in (of_rates, of_outputs)
    ]
    both = np.array([*wanted, np.any(wanted, axis=0)])
    live = [i for i in sorted(states) if ("state", i) in active]
    places = [rows.of(s) if s and s in active else -1 for s in outputs]
    return Reach(np.array(live, np.int64), both, np.array(places, np.int64))


def _graph(rows: Rows, present: frozenset[str]) -> list[tuple[set[Source], set[Source]]]:
    """Inputs and outputs of every equation, with the effects that are present."""
    rates = list(RATES.values())
    graph = []
    for node in rows.nodes:
        calls = [c for c in node.calls if c.effect is None or c.effect.name in present]
        takes = {s for c in calls for each in rows.sources(c).values() for s in each if s}
        if node.name in HISTORY_OF:
            takes |= {s for name in HISTORY_OF[node.name] if (s := rows.source(name, None))}
        gives: set[Source] = {("quantity", name) for name in node.gives}
        gives |= {("rate", rates.index(name)) for name in node.gives if name in rates}
        for call in calls:
            for state in call.governs:
                assert call.effect is not None
                gives.add(("rate", rows.order.states.index(f"{call.effect.name}.{state}")))
        graph.append((takes, gives))
    for copied, source in COPIED.items():
        number, of = (rows.order.states.index(name) for name in (copied, source))
        graph.append(({("state", of)}, {("rate", number)}))
    return graph


def _active(
    graph: list[tuple[set[Source], set[Source]]], columns: Iterable[Source], free: list[int]
) -> set[Source]:
    """Everything that some column reaches."""
    active = set(columns)
    for i, name in enumerate(Inputs.names):
        state = name.removeprefix("measured_")
        if ("input", i) in active and state in LED and state != name:
            active.add(("state", list(RATES).index(state)))
    before = -1
    while before != len(active):
        before = len(active)
        for takes, gives in graph:
            if takes & active:
                active |= gives
        states = _states(active)
        active |= {("rate", i) for i in states}
        active |= {("state", i) for i in free if ("rate", i) in active}
        if 0 in states:
            active.add(("state", 1))  # of a throttle that is prescribed or stopped
    return active


def _behind(graph: list[tuple[set[Source], set[Source]]], needed: set[Source]) -> set[Source]:
    """Everything on which some quantities and rates depend at an instant."""
    needed = set(needed)
    for takes, gives in reversed(graph):
        if gives & needed:
            needed |= takes
    if ("state", 0) in needed:
        needed.add(("state", 1))  # the rate decides how far a plate comes back from its stop
    return needed


def _states(keys: set[Source]) -> set[int]:
    return {which for kind, which in keys if kind == "state" and isinstance(which, int)}
