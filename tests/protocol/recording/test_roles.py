"""Laws of role maps: those that are kept here are sound, and a slip in one is told."""

from pathlib import Path

import pytest

from slipbench import dbc
from slipbench.protocol.configuration import parse, read_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear

MAPS = sorted((Path(__file__).parents[3] / "examples/roles").glob("*.toml"))


def role_map(**role):
    return parse({"title": "x", "roles": {"gear": role}}, RoleMap, "roles.toml")


def test_the_real_captures_have_maps():
    assert {path.stem for path in MAPS} >= {"subaru_wrx", "yamaha_r1", "gt86", "gt350", "comma2k19"}


@pytest.mark.parametrize("path", [*MAPS, dbc.MOTORBIKE_ROLES], ids=lambda path: path.stem)
def test_every_map_reads_and_names_its_tables(path):
    found = read_toml(path, RoleMap)
    used = {source.table or "main" for source in found.roles.values() if source.column}
    assert set(found.tables) <= used
    for source in found.roles.values():
        assert all(name.count(".") == 1 for name in source.signals)


@pytest.mark.parametrize("name", ROLES)
def test_every_role_has_a_unit_that_converts(name):
    if ROLES[name].unit != "count":
        assert linear(ROLES[name].unit, ROLES[name].unit) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("role", "told"),
    [
        ({}, "exactly one"),
        ({"signals": ["A.b"], "column": "c"}, "exactly one"),
        ({"teeth": "RearTeeth"}, "belong together"),
        ({"signals": ["A.b"], "clock": "ecu"}, "must be given together"),
        ({"signals": ["A.b"], "time_signal": "A.t"}, "must be given together"),
        ({"signals": ["A.b"], "sing": -1}, "did you mean 'sign'"),
        ({"signals": ["A.b"], "sign": 2}, "sign"),
        ({"signals": ["A.b"], "delay": "3 kg"}, "delay"),
    ],
)
def test_a_slip_is_told(role, told):
    with pytest.raises(InputError, match=told):
        role_map(**role)


def test_an_unknown_role_names_the_nearest():
    with pytest.raises(InputError, match="did you mean 'gear'"):
        parse({"title": "x", "roles": {"geer": {"signals": ["A.b"]}}}, RoleMap, "roles.toml")
