"""Effects that mask each other, identified with the full library.

Without belt and blindness the time constant diverges, and some even function of the voltage
explains more than either of the two.
"""

import pytest

from slipbench.identification.mismatch.systems.system import ModelSystem
from tests.identification.mismatch.drives import FREQUENCY, recorded
from tests.identification.mismatch.laws.explained import effect, explained, reported
from tests.paths import MODELS


@pytest.mark.parametrize("seed", [82, 86, 88])
def test_a_blind_counter_behind_an_elastic_belt_is_found_among_all_effects(seed) -> None:
    drives = ModelSystem.load(MODELS / "coupled_drives.toml")
    rides = [recorded(s, seconds=8.0) for s in (seed, seed + 1)]
    found = explained(drives, rides[:1], rides[1:])
    assert {e.name for e in found.effects} == {"direction_blind", "elastic_transmission"}, reported(
        found
    )
    values = {p.name: p.value for p in effect(found, "elastic_transmission").parameters}
    assert values["frequency"] == pytest.approx(FREQUENCY, rel=0.1)
    assert found.held_out[0].improved < 0.1 * found.held_out[0].nominal
