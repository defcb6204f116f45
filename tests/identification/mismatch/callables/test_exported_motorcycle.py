"""The exported motorcycle is an ordinary FMU: missing effects are named with magnitude."""

import pytest

from slipbench.identification.mismatch.runs import read_system
from tests.identification.mismatch.callables.fmus.building import needs_compiler
from tests.identification.mismatch.callables.fmus.motorcycle import exported, recorded_ride
from tests.identification.mismatch.laws.explained import explained, holds, names, reported

pytestmark = needs_compiler
LIBRARY = ["saturation", "lag", "hysteresis", "sensor_delay"]


@pytest.fixture
def system(request, tmp_path):
    pytest.importorskip("fmpy", reason="pip install 'slipbench[fmu]'")
    return read_system(exported(tmp_path, request.param))


@pytest.mark.parametrize("system", [2], ids=["FMI 2.0"], indirect=True)
def test_nothing_is_found_where_it_lacks_nothing(system):
    found = explained(system, [recorded_ride(1)], [recorded_ride(2)], LIBRARY)
    assert not found.mismatch, reported(found)


@pytest.mark.parametrize("system", [3], ids=["FMI 3.0"], indirect=True)
def test_two_effects_at_an_input_and_at_an_output_are_named_with_their_sizes(system):
    lacks = {"ceiling": 0.11, "lag": 0.05}
    rides = [recorded_ride(seed, **lacks) for seed in (1, 2)]
    found = explained(system, rides[:1], rides[1:], LIBRARY)
    assert names(found) == ["lag.engine_speed", "saturation.throttle_command"], reported(found)
    assert holds(found, "saturation", "limit", 0.11)
    assert holds(found, "lag", "time_constant", 0.05, slack=0.01)
