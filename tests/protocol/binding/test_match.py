"""Laws of the proposal: right on databases that it was not made for; of two doubtful signals it names both."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from slipbench import dbc
from slipbench.protocol.binding.binding import bind, read_binding
from slipbench.protocol.binding.binding_text import binding_text
from slipbench.protocol.binding.capture import read_capture
from slipbench.protocol.binding.propose import Proposal, propose
from slipbench.protocol.binding.words import words_of
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.recording.role_map import RoleMap
from tests.paths import ROOT
from tests.protocol.binding.published_names import DATABASES, Row
from tests.recordings import recording

OWN = load_database(dbc.MOTORBIKE)
# Recordings, their databases, and signals that are the role as well as the one of examples/roles.
CAPTURES = {
    "subaru_wrx": ("subaru_wrx/sample_can_spec.dbc", "subaru_wrx/can_sample.log"),
    "yamaha_r1": ("yamaha_r1/session.dbc", "yamaha_r1/session.log"),
    "gt86": ("subaru_wrx/sample_can_spec.dbc", "gt86_gt350/gt86_vsslog.log"),
    "gt350": ("gt86_gt350/ford_lincoln_base_pt.dbc", "gt86_gt350/gt350_vsslog.trc"),
    "comma2k19": ("comma2k19/segment.dbc", "comma2k19/segment.log"),
}
ALSO = {
    "gt350": {
        "rear_tooth_counter": "WheelData.WhlRotatRr_No_Cnt",
        "front_tooth_counter": "WheelData.WhlRotatFr_No_Cnt",
        "vehicle_speed": "EngVehicleSpThrottle2.Veh_V_ActlEng",
    }
}
LOST = {"rider_grip"}  # in two captures the one pedal signal already is throttle_position


def database_of(rows: tuple[Row, ...]) -> Database:
    messages: dict[str, list[Signal]] = {}
    for message, name, unit, bits, _ in rows:
        held = messages.setdefault(message, [])
        start = sum(signal.length for signal in held)
        held.append(Signal(name, start, bits, unit=unit))
    return Database(
        "published",
        "",
        tuple(
            Message(name, 0x100 + number, 32, tuple(signals))
            for number, (name, signals) in enumerate(messages.items())
        ),
    )


@pytest.mark.parametrize(
    ("name", "least"), [("honda", 11), ("race_ecu", 18), ("german", 13), ("motorcycle", 17)]
)
def test_names_of_published_databases(name: str, least: int) -> None:
    """59 of 60 roles are right, none is wrong; 57 were before the unit m/s2 was known to the units."""
    wanted = {role: f"{row[0]}.{row[1]}" for row in DATABASES[name] if (role := row[4])}
    bound = propose(database_of(DATABASES[name])).bound
    right = [
        role for role, signal in wanted.items() if role in bound and bound[role].name == signal
    ]
    wrong = [role for role in wanted if role in bound and bound[role].name != wanted[role]]
    assert len(right) >= least, set(wanted) - set(right)
    assert wrong == []


@pytest.fixture(scope="module")
def proposals() -> dict[str, Proposal]:
    return {}


def proposal_of(name: str, proposals: dict[str, Proposal]) -> Proposal:
    if name not in proposals:
        database, log = (recording(each) for each in CAPTURES[name])
        known = load_database(database)
        proposals[name] = propose(known, read_capture(log, known))
    return proposals[name]


@pytest.mark.parametrize("name", CAPTURES)
def test_the_first_proposal_on_a_real_capture_is_right(name: str, proposals) -> None:
    """66 of 68 roles; of the names alone 64 (the Ford's database has four vehicle speeds)."""
    found = proposal_of(name, proposals).bound
    roles = read_toml(ROOT / f"examples/roles/{name}.toml", RoleMap).roles
    wanted = {role: source.signals for role, source in roles.items() if source.signals}
    for role, signals in wanted.items():
        if role in LOST and role not in found:
            continue
        assert found[role].name in (*signals, ALSO.get(name, {}).get(role)), role


@pytest.mark.parametrize("name", CAPTURES)
def test_the_proposed_file_binds_every_role_that_it_names(name, proposals, tmp_path) -> None:
    proposal = proposal_of(name, proposals)
    path = tmp_path / "bike.toml"
    path.write_text(binding_text(proposal, name, str(recording(CAPTURES[name][0]))))
    binding = read_binding(path)
    assert binding.roles is not None
    assert set(proposal.bound) <= set(binding.roles.roles)
    assert not binding.can_request
    named = {signal for source in binding.roles.roles.values() for signal in source.signals}
    assert named == {found.name for found in proposal.bound.values()}


def test_what_the_capture_shows_of_gears_and_speeds_stands_in_the_reasons(proposals) -> None:
    bound = proposal_of("subaru_wrx", proposals).bound
    assert any("gear ratios" in reason for reason in bound["engine_speed"].reasons)
    assert any("explains" in reason for reason in bound["gear"].reasons)
    assert any("agrees with" in reason for reason in bound["rear_wheel_speed"].reasons)


def test_our_own_database_is_bound_whole_and_a_trial_can_ride_on_it(tmp_path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(binding_text(propose(OWN), "own", str(dbc.MOTORBIKE)))
    binding = read_binding(path)
    binding.require_trial(spark=True)
    ours = tomllib.loads((ROOT / "dbc/motorbike_roles.toml").read_text())["roles"]
    assert binding.roles is not None
    bound = binding.roles.roles
    wrong = {
        role: bound[role].signals
        for role, source in ours.items()
        if role not in bound or list(bound[role].signals) != source.get("signals", [])
    }
    assert wrong == {}
    assert bound["rear_teeth"].anchor == "RearEncoderStatus"


def test_a_foreign_motorcycle_is_bound_to_its_requests_too() -> None:
    """18 of 19 roles; the authority is called Iv_Mode there, which no name can tell."""
    folder = ROOT / "examples/bindings"
    found = propose(load_database(folder / "superbike.dbc")).bound
    roles = read_toml(folder / "superbike.toml", RoleMap).roles
    wrong = [r for r, s in roles.items() if r not in found or found[r].name not in s.signals]
    assert wrong == ["authority"]


SYNONYMS = (
    {"engine": "Eng", "speed": "Spd", "throttle": "TB", "position": "Pos", "front": "F"},
    {"engine": "motor", "speed": "velocity", "brake": "Brk", "gear": "Gang", "clutch": "Kupplung"},
    {"engine": "crank", "speed": "rpm", "grip": "TwistGrip", "teeth": "tooth", "spark": "ign"},
)
STYLES = {
    "Camel": lambda words: "".join(word[:1].upper() + word[1:] for word in words),
    "UPPER": lambda words: "_".join(words).upper(),
    "glued": lambda words: "".join(words).lower() if len(words) < 3 else "_".join(words).lower(),
}


def renamed(database: Database, synonyms: dict[str, str], style: str) -> Database:
    """The database with other words and another style of names; `time` and selectors keep theirs."""

    def name(text: str) -> str:
        return STYLES[style]([synonyms.get(word, word) for word in words_of(text)])

    def message(old: Message) -> Message:
        own = {signal.name: name(signal.name) for signal in old.signals}
        signals = tuple(
            replace(
                signal,
                name=own[signal.name] + _digits(signal.name),
                multiplexer=own[signal.multiplexer] if signal.multiplexer else None,
            )
            for signal in old.signals
        )
        return replace(old, name=name(old.name), signals=signals)

    return replace(database, messages=tuple(message(each) for each in database.messages))


def _digits(name: str) -> str:
    return "".join(re.findall(r"\d+", name))


@pytest.mark.parametrize(
    ("synonyms", "style"),
    [
        (synonyms, style)
        for number, synonyms in enumerate(SYNONYMS)
        for style in STYLES
        if number or style != "glued"  # words of one or two letters run together are no words
    ],
)
def test_a_database_with_synonyms_in_another_style_is_bound_alike(synonyms, style) -> None:
    """Roles of the database: at most two of 33 change, and none of those that a trial needs."""
    changed = renamed(OWN, synonyms, style)
    place = {
        (m.identifier, s.start, s.length): f"{n.name}.{t.name}"
        for m, n in zip(OWN.messages, changed.messages, strict=True)
        for s, t in zip(m.signals, n.signals, strict=True)
    }
    before, after = propose(OWN).bound, propose(changed).bound
    expected = {
        role: place[found.message.identifier, found.signal.start, found.signal.length]
        for role, found in before.items()
    }
    differs = {
        r: after.get(r) and after[r].name
        for r, w in expected.items()
        if r not in after or after[r].name != w
    }
    assert len(differs) <= 2, differs


def test_a_message_of_requests_holds_no_status() -> None:
    """One message has one sender: what is beside a request is not what the motorcycle measures."""
    signals = (
        Signal("ThrottleRequest", 0, 16, unit="%"),
        Signal("EngineSpeed", 16, 16, unit="rpm"),
    )
    one = Database("x.dbc", "", (Message("Frame1", 0x10, 8, signals),))
    assert set(propose(one).bound) in ({"throttle_request"}, {"engine_speed"})


@pytest.mark.parametrize("word", ["Request", "Target", "Demand", "Setpoint", "Soll"])
def test_what_is_wanted_is_not_proposed_as_what_is(word: str) -> None:
    signals = (
        Signal(f"Throttle{word}", 0, 16, unit="%"),
        Signal(f"EngineSpeed{word}", 16, 16, unit="rpm"),
        Signal(f"Gear{word}", 32, 4),
    )
    bound = propose(Database("x.dbc", "", (Message("Frame1", 0x10, 8, signals),))).bound
    assert not {"throttle_position", "engine_speed", "gear"} & set(bound)


def test_a_speed_without_a_unit_is_left_to_the_user(tmp_path) -> None:
    bare = Database(
        "x.dbc",
        "",
        (
            Message(
                "Wheels",
                0x10,
                8,
                (Signal("FrontWheelSpeed", 0, 16), Signal("Rpm", 16, 16, unit="rpm")),
            ),
        ),
    )
    text = binding_text(propose(bare), "bare", "x.dbc")
    assert "# [roles.front_wheel_speed]" in text
    assert "\n[roles.front_wheel_speed]" not in text
    roles = RoleMap.model_validate(tomllib.loads(text))
    bind(roles, bare, Path("x.toml"))


def test_names_with_quotes_and_control_characters_stay_toml() -> None:
    text = binding_text(propose(OWN), 'a "quoted"\n\\ title', "a\\b.dbc")
    assert tomllib.loads(text)["title"] == 'a "quoted"\n\\ title'
