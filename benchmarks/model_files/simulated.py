"""A plant as it is: numbers that the file does not know, a hidden effect, integration in small steps."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import tomli_w

from benchmarks.model_files.systems import Plant
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording

FINER = 16
"""Steps of integration of the plant for each sample."""
FARTHEST = 1.8
"""Standard deviations by which a number of the plant may differ from the file."""
NORMAL_95 = 1.96
CHAIN = CausalPartition({"system": ()}, ())
Signals = Mapping[str, Floats]


def nominal(plant: Plant) -> ModelSystem:
    """Return the system as its file states it."""
    return ModelSystem.load(plant.file)


def drawn(plant: Plant, rng: np.random.Generator) -> ModelSystem:
    """Return the system with numbers within what the file states."""
    tree = load_toml(plant.file)
    for number in tree["parameters"].values():
        away = np.clip(rng.standard_normal(), -FARTHEST, FARTHEST)
        number["value"] = float(number["value"] + number["plus_minus"] / NORMAL_95 * away)
    return of_tree(tree, plant)


def of_tree(tree: dict[str, object], plant: Plant) -> ModelSystem:
    """Return the system of a file with steps of integration as the plant has them."""
    tree["step"] = f"{plant.period / FINER * 1e3:g} ms"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "true.toml"
        path.write_text(tomli_w.dumps(tree), encoding="utf-8")
        return ModelSystem.load(path)


def outputs_of(
    system: ModelSystem, plant: Plant, inputs: Signals, effects: Sequence[Effect] = ()
) -> dict[str, Floats]:
    """Return the outputs without noise, (samples,) each. Raises PlantError where it cannot run."""
    any_outputs = np.random.default_rng(0).standard_normal((len(plant.outputs), plant.count))
    placeholders = dict(zip(plant.outputs, any_outputs, strict=True))
    for name, first in plant.starts.items():
        placeholders[name][0] = first
    record = system.prepare(recording(plant, {**inputs, **placeholders}, "simulated"))
    there = system.at([], np.zeros(0), tuple(effects))
    shown = there.simulate(SimulationInput.undisturbed(record, CHAIN, "system"))
    found = {}
    for name in plant.outputs:
        rows = np.asarray(shown[name])[: plant.count - 1]
        found[name] = np.concatenate(([plant.starts.get(name, 0.0)], rows))
    return found


def recording(plant: Plant, values: Signals, name: str) -> Recording:
    """Return a recording of all channels. values: (samples,) each, SI."""
    roles = plant.roles
    moments = plant.period * np.arange(plant.count)
    channels = {
        role: Channel(role, moments, np.asarray(y), roles.unit(role), "bus", "simulated")
        for role, y in values.items()
    }
    return Recording(Path(name), {}, None, roles, channels, {})


def recorded(
    system: ModelSystem,
    plant: Plant,
    effects: Sequence[Effect],
    rng: np.random.Generator,
    name: str,
) -> Recording:
    """Simulate a recording with noise."""
    inputs = {k: d.drawn(rng, plant.count, plant.period) for k, d in plant.inputs.items()}
    shown = outputs_of(system, plant, inputs, effects)
    noisy = {
        k: y + plant.outputs[k][1] * rng.standard_normal(plant.count) for k, y in shown.items()
    }
    return recording(plant, {**inputs, **noisy}, name)
