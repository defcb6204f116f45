"""The reference of the files says what the models say, and every key has a meaning."""

import subprocess
import sys
from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field

from slipbench.bench.session.plan_file import SessionPlan
from slipbench.identification.fleet.fleet_file import FleetFile
from slipbench.identification.mismatch.systems.effects.library import LIBRARY
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.expression import ARGUMENTS, CALLED, read_expression
from slipbench.identification.mismatch.systems.model_file import (
    ActingEffect,
    ModelFile,
    load_model_file,
)
from slipbench.identification.mismatch.systems.placing import acting, places
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.identification.report.identification_file import FILES
from slipbench.protocol.configuration import Seconds, Section, load_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import Between, Whole
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.trial_file import TrialFile
from slipbench.reference import models
from slipbench.reference.meanings import meanings
from slipbench.reference.page import Key
from slipbench.reference.pages import pages, texts
from slipbench.reference.places import EXAMPLE, acts_at, kinds
from tests.paths import ROOT

FOLDER = ROOT / "docs" / "reference"
READ = (TrialFile, SessionPlan, RoleMap, ControllerFile, ModelFile, FleetFile, *FILES.values())


class Wheel(Section):
    """A wheel.

    radius  rolling radius,
            under load
    """

    radius: Annotated[float, Between("m", "10 cm", "1 m", "no wheel is larger")] = Field(
        default="300 mm", validate_default=True
    )


class Small(Section):
    """A small file.

    delay   dead time
    begin   first gear
    colour  of the frame
    """

    delay: Seconds = Field(default=0.5, gt=0)
    first: Annotated[int, Whole(1, 6, "there is no seventh")] | None = Field(
        default=None, alias="begin"
    )
    colour: Literal["red", "blue"]
    wheels: tuple[Wheel, ...] = ()


def test_a_row_states_unit_default_bounds_with_reason_and_meaning() -> None:
    top, wheel = models.tables(Small)
    assert top.keys == (
        Key("delay", "s", "0.5", "above 0", "dead time"),
        Key("begin", "whole number", "none", "1 to 6, because there is no seventh", "first gear"),
        Key("colour", '"red" or "blue"', "required", "", "of the frame"),
        Key("wheels", "list of: table", "", "", "A wheel."),
    )
    assert (top.text, wheel.title) == ("A small file.", "`wheels[]`")
    bounds = "10 cm to 1 m, because no wheel is larger"
    meaning = "rolling radius, under load"
    assert wheel.keys == (Key("radius", "m, mm, cm, km", "300 mm", bounds, meaning),)


def test_the_committed_pages_are_those_of_the_models() -> None:
    committed = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.iterdir()}
    assert committed == texts(), "run make reference"


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.file)
def test_every_key_has_a_meaning_and_a_unit_or_kind(page) -> None:
    keys = [(table.title, key) for table in page.tables() for key in table.keys]
    assert [f"{title}: {k.name}" for title, k in keys if not (k.meaning and k.unit)] == []


@pytest.mark.parametrize("model", READ, ids=lambda model: model.__name__)
def test_a_docstring_gives_meanings_to_keys_of_its_table_only(model: type[Section]) -> None:
    for one in models.models(model):
        keys = {field.alias or name for name, field in one.model_fields.items()}
        assert set(meanings(one)) <= keys, one.__name__


def test_the_example_of_a_model_file_uses_every_key() -> None:
    without = [
        f"{table.title}: {key.name}"
        for table in models.tables(ModelFile, load_toml(EXAMPLE))
        for key in table.keys
        if not key.example
    ]
    assert without == []
    assert ModelSystem.load(EXAMPLE).notes == ()


def may_act(effect: type[SeamEffect], place: str, file: ModelFile) -> bool:
    """Whether the reader of model files lets an effect act at a place, with whatever it uses."""
    for using in ("", *file.inputs, *file.states):
        try:
            acting(ActingEffect(name=effect.name, at=place, using=using), file, "here")
        except InputError:
            continue
        return True
    return False


@pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: effect.name)
def test_the_page_names_the_places_where_the_reader_lets_an_effect_act(
    effect: type[SeamEffect],
) -> None:
    file = load_model_file(EXAMPLE)
    allowed = [p for p in places(file) if may_act(effect, p.name, file)]
    assert {p.kind for p in allowed} == set(kinds(effect))
    said = acts_at(effect)
    assert said in texts()["model_effects.md"]
    assert said.endswith(f"In the example: {', '.join(f'`{p.name}`' for p in allowed)}.")


@pytest.mark.parametrize("name", CALLED)
def test_every_function_of_equations_is_on_the_page_of_the_model_file(name: str) -> None:
    assert f"`{name}" in texts()["model.md"]
    assert read_expression(f"{name}({', '.join('1' * ARGUMENTS.get(name, 1))})", [], "here")


def test_every_role_is_on_the_page_of_the_binding() -> None:
    text = texts()["binding.md"]
    assert [name for name in ROLES if f"| `{name}` |" not in text] == []


def test_the_command_writes_the_pages_and_removes_those_of_no_file(tmp_path: Path) -> None:
    (tmp_path / "of_yesterday.md").write_text("old", encoding="utf-8")
    subprocess.run([sys.executable, "-m", "slipbench.reference", tmp_path], check=True)
    assert {path.name for path in tmp_path.iterdir()} == set(texts())
