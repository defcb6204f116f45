"""Two effects that mask each other, in a system with parameters known within factors."""

import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.identification.mismatch.thresholds import REQUIRED_GAIN
from tests.identification.mismatch.drives import DAMPING, FREQUENCY, recorded
from tests.paths import MODELS

MODEL = MODELS / "coupled_drives.toml"
ALONE = ("asymmetry", "direction_blind")
"""A blind counter, and an effect that alone explains more than blindness without the belt."""


@pytest.fixture(scope="module")
def drives() -> ModelSystem:
    return ModelSystem.load(MODEL)


def explained(drives: ModelSystem, *rides, others=ALONE):
    records = [drives.prepare(r) for r in rides]
    library = [
        k
        for k in drives.library
        if k.name in others or (k.name == "elastic_transmission" and k.place.name == "torque")
    ]
    return verdict(analyse(begin(drives, records[:1], records[1:]), library))


def test_a_counter_blind_to_direction_is_named_where_calibration_runs_away(drives) -> None:
    found = explained(drives, recorded(81, belt=False, seconds=6.0))
    assert [e.name for e in found.effects] == ["direction_blind"]


def test_a_blind_counter_behind_an_elastic_belt_is_two_effects(drives) -> None:
    rides = [recorded(seed, seconds=8.0) for seed in (82, 83)]
    found = explained(drives, *rides)
    assert {e.name for e in found.effects} == {"direction_blind", "elastic_transmission"}
    belt = next(e for e in found.effects if e.name == "elastic_transmission")
    estimates = {p.name: p.value for p in belt.parameters}
    assert estimates["frequency"] == pytest.approx(FREQUENCY, rel=0.1)
    assert estimates["damping"] == pytest.approx(DAMPING, rel=0.6)  # other belt place in the file
    assert found.held_out[0].improved < 0.1 * found.held_out[0].nominal


def test_names_with_which_the_simulation_predicts_worse_do_not_stand(drives) -> None:
    """Without blindness in the library a rate limit fits these rides; the error is 1.57 V.

    The error of the re-calibrated file is 0.42 V.
    """
    rides = [recorded(seed, seconds=8.0) for seed in (94, 95)]
    found = explained(drives, *rides, others=("gain_with_channel", "rate_limit", "delay"))
    assert found.held_out[0].improved < found.held_out[0].calibrated
    (lost,) = found.vetoes
    assert lost.name == "gain_with_channel.torque/voltage + rate_limit.voltage"
    assert lost.gain < -REQUIRED_GAIN
