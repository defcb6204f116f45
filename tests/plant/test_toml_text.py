"""A TOML text with new numbers keeps everything else, however its tables are written."""

import tomllib

import pytest

from slipbench.plant.toml_text import edited

FORMS = {
    "inline": 'a = 1 # first\n[engine]\ntorque = { value = 2, unit = "k" } # Nm\n',
    "table": 'a = 1 # first\n[engine.torque] # Nm\nvalue = 2\nunit = "k"\n',
    "dotted": 'a = 1 # first\nengine.torque.value = 2\nengine.torque.unit = "k" # Nm\n',
}


def thousand(unit, to):
    return (1e3, 0.0) if unit == "k" else (1.0, 0.0)


@pytest.mark.parametrize("form", FORMS)
def test_a_number_is_set_in_its_own_unit_in_every_form(form):
    wanted = {"engine": {"torque": {"value": 2500.0, "unit": "1", "plus_minus": 100.0}}}
    text = edited(FORMS[form], wanted, thousand)
    torque = tomllib.loads(text)["engine"]["torque"]
    assert torque == {"value": 2.5, "unit": "k", "plus_minus": 0.1}
    assert "a = 1 # first" in text
    assert "# Nm" in text


@pytest.mark.parametrize("form", FORMS)
def test_a_number_that_is_the_same_stays_as_it_was_written(form):
    wanted = {"engine": {"torque": {"value": 2000.0000000000002, "unit": "1"}}}
    assert edited(FORMS[form], wanted, thousand) == FORMS[form]


@pytest.mark.parametrize(
    "start",
    [
        "",
        '[[effects]] # mine\nname = "lag"\nt = { value = 1, unit = "k" }\n',
        'effects = [{ name = "lag", t = { value = 1, unit = "k" } }] # mine\n[engine]\n',
    ],
)
def test_a_table_of_a_list_is_changed_where_it_is_there_and_else_appended(start):
    lag = {"name": "lag", "t": {"value": 3000.0, "unit": "1"}}
    gap = {"name": "gap", "values": {"w": {"value": 1 / 3, "unit": "1"}}}
    text = edited(start, {"effects": [lag, gap]}, thousand)
    one, other = tomllib.loads(text)["effects"]
    assert one["t"]["value"] == (3.0 if start else 3000.0)
    assert other["values"]["w"]["value"] == 0.333333333
    assert ("# mine" in text) == bool(start)
