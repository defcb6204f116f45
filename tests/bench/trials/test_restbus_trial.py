"""A whole trial rides through devices that are not of the virtual motorcycle, on the simulated clock."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from slipbench import dbc
from slipbench.bench.bus.simulated_bus import SimulatedNode
from slipbench.bench.loop.clock import MILLISECOND
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.simulated_trial import DEVICE_PHASE, START, simulated_trial
from slipbench.bench.vehicle.nodes import MESSAGES_OF, simulated_nodes
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.database.database import load_database
from tests.bench.trials.test_whole_trial import prepared
from tests.faults.run_case import SHORT


def other_simulation(scenario: Scenario) -> Callable[[SimulatedNode], Callable[[int], None]]:
    """A device made of a second virtual motorcycle, which simulates the remaining nodes."""

    def connect(node: SimulatedNode) -> Callable[[int], None]:
        motorcycle = VirtualMotorcycle(scenario, node, Codec(load_database(dbc.MOTORBIKE)))

        def run_until(time_ns: int) -> None:
            number = (time_ns - START - DEVICE_PHASE) // MILLISECOND
            motorcycle.tick(number, time_ns)

        return run_until

    return connect


def ride(folder: Path, node: str, theirs: str) -> Outcome:
    """Ride with two simulations: one without `node`, the other with `theirs` alone."""
    trial = prepared(**SHORT)
    without = replace(trial.scenario, nodes=simulated_nodes(without=node))
    other = replace(trial.scenario, nodes=simulated_nodes(only=theirs))
    with simulated_trial(
        replace(trial, scenario=without), devices={"other": other_simulation(other)}
    ) as ridden:
        return ridden.run(folder)


@pytest.mark.parametrize("node", MESSAGES_OF)
def test_a_trial_rides_through_any_node_that_another_simulation_takes(node, tmp_path) -> None:
    outcome = ride(tmp_path, node, node)
    assert outcome.done, outcome.trip
    assert outcome.notes == ()


def test_two_simulations_of_one_node_end_and_the_trial_does_not_start(tmp_path) -> None:
    outcome = ride(tmp_path, "rider", "rider,optical")
    assert not outcome.done
    assert any("another device" in note and "optical" in note for note in outcome.notes)
