"""A table has the static part of a controller, and never more than its limits."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from slipbench.controllers.limits import Range
from slipbench.controllers.slip_controller import from_tree
from slipbench.identification.ecu.exported_law import exported_law
from slipbench.identification.ecu.rusefi import SLIP_STEP, TABLE_SIZE
from slipbench.identification.ecu.static_gain import static_gain
from slipbench.identification.ecu.traction_table import NAMESPACE, traction_table, write_table
from slipbench.protocol.errors import InputError
from tests.identification.ecu.conftest import SHIPPED, TARGET, scheduled, shipped

FREE = Range(-1e9, 1e9)


def table_of(name, target=TARGET):
    file = scheduled() if name == "scheduled" else shipped(name)
    return traction_table(exported_law(file, target, 200.0))


@pytest.mark.parametrize("name", [n for n in SHIPPED if n != "mixed"])
def test_the_static_gain_is_what_a_constant_error_adds_to_the_integral(name):
    tree = shipped(name).model_dump()
    law = replace(from_tree({**tree, "governor": None, "prefilter": ()}).law, limits=FREE)
    state, error, commands = law.start(0.0, 0.0, 0.0), 0.001, []
    for _ in range(6000):
        command, state = law.update(state, error, 0.0, tree["period"])
        commands.append(command)
    n = np.arange(1, 6001)
    _, offset = np.polyfit(n[-2000:] - 1, commands[-2000:], 1)
    assert offset / error == pytest.approx(static_gain(tree["law"]), rel=0.02)


@pytest.mark.parametrize("name", [*SHIPPED, "scheduled"])
@pytest.mark.parametrize("target", [0.015, 0.03, 0.1])
def test_the_drop_is_zero_up_to_the_target_grows_and_keeps_the_limit(name, target):
    table = table_of(name, target)
    law = exported_law(shipped("spark") if name == "scheduled" else shipped(name), target, 200.0)
    low = (law.tree["mixed"] or {"throttle": law.tree["limits"]})["throttle"]["low"]
    unit = 100.0 if law.file.actuator != "spark" else np.degrees(1.0)
    assert not table.drop[0].any()
    assert table.ratio[0] <= 1.0 + target + 1e-9
    assert (np.diff(table.drop, axis=0) >= 0.0).all()
    assert table.drop[-1].min() > 0.0
    assert table.drop.max() <= -low * unit + 1e-9
    assert np.array_equal(table.drop, np.round(table.drop))


@pytest.mark.parametrize("name", [*SHIPPED, "scheduled"])
def test_axes_are_those_that_the_firmware_can_hold(name):
    table = table_of(name)
    assert table.drop.shape == (TABLE_SIZE, TABLE_SIZE)
    for axis in (table.ratio, table.speed):
        assert axis.shape == (TABLE_SIZE,)
        assert (np.diff(axis) > 0.0).all()
    assert np.allclose(table.ratio / SLIP_STEP, np.round(table.ratio / SLIP_STEP))
    assert table.speed.min() >= 0
    assert table.speed.max() <= 255


def test_a_scheduled_gain_follows_the_speed():
    table = table_of("scheduled")
    assert table.drop[1, 0] < table.drop[1, -1]
    assert table.speed[0] == 72.0
    assert table.speed[-1] == 252.0


def test_between_its_points_the_table_is_interpolated_and_outside_held():
    table = table_of("throttle")
    middle = 0.5 * (table.ratio[0] + table.ratio[1])
    assert table.at(middle, 100.0) == pytest.approx(0.5 * table.drop[1, 0])
    assert table.at(0.5, 10.0) == 0.0
    assert table.at(9.0, 900.0) == table.drop[-1, -1]


@pytest.mark.parametrize(("convention", "sign"), [("added", -1.0), ("subtracted", 1.0)])
def test_the_file_has_axes_and_numbers_with_the_sign_of_the_firmware(tmp_path, convention, sign):
    table, path = table_of("spark"), tmp_path / "one.table"
    write_table(table, path, convention)
    assert "-0.0" not in path.read_text()
    found = ElementTree.parse(path).getroot().find(f"{{{NAMESPACE}}}table")
    assert found is not None
    read = {
        part.tag.rpartition("}")[2]: np.array((part.text or "").split(), float) for part in found
    }
    assert np.allclose(read["xAxis"], table.speed)
    assert np.allclose(read["yAxis"], table.ratio)
    assert np.array_equal(read["zValues"].reshape(TABLE_SIZE, TABLE_SIZE), sign * table.drop)


def test_a_law_without_a_static_part_is_refused():
    spark = shipped("spark")
    law = spark.law.model_copy(update={"proportional": 0.0})
    with pytest.raises(InputError, match="does not reduce torque"):
        traction_table(exported_law(spark.model_copy(update={"law": law}), TARGET, 200.0))
