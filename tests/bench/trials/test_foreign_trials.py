"""Whole trials on databases that share no name with the bench's own, on the simulated clock."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pytest
import tomli_w

from slipbench.bench.bus.faults import FaultPlan, Lost, Where
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.run import run_trial
from slipbench.identification.models.study import Study
from slipbench.identification.report.key_figures import key_figures
from slipbench.identification.response.identify import Identification, identify
from slipbench.identification.response.resonance import Resonance
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, Phase
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.run_folder import read as read_run
from slipbench.protocol.recording.summary import imported
from tests.paths import TRIALS
from tests.protocol.binding.foreign import foreign
from tests.protocol.binding.test_binding import DBC, changed

SEED = 11  # of the drawn database
SILENT_FROM = 2.5  # s: without a TrialStatus the rider presses the button at 2.1 s, see Rider.watch
SWEEP = {"waveform": "linear_sweep", "start": "2 Hz", "stop": "12 Hz", "duration": "6 s"}
SHORT = {"start": "2 Hz", "stop": "5 Hz", "duration": "1 s", "amplitude": "1 %"}
ECM = frozenset({193, 194})  # messages of the superbike's ECU


KEPT = TemporaryDirectory()  # runs that several tests read


class Ride(NamedTuple):
    prepared: Prepared
    outcome: Outcome
    folder: Path


def trial(folder: Path, name: str, excitation: dict[str, Any], rider: dict[str, Any]) -> Path:
    """A shipped trial, shortened."""
    data = load_toml(TRIALS / f"{name}.toml")
    data["excitation"] |= excitation
    data["operating_point"]["steady_for"] = "100 ms"
    data["vehicle"] = str((TRIALS / data["vehicle"]).resolve())
    data |= {"settling": "100 ms", "hand_back": "100 ms"}
    data["rider"] = {"presses_button_after": "100 ms", **rider}
    if "controller" in data:
        data["controller"]["file"] = str((TRIALS / data["controller"]["file"]).resolve())
    path = folder / "trial.toml"
    path.write_text(tomli_w.dumps(data), encoding="utf-8")
    return path


def superbike(folder: Path, data: dict[str, Any] | None = None) -> Path:
    (folder / "superbike.dbc").write_text(DBC, encoding="utf-8")
    path = folder / "superbike.toml"
    path.write_text(tomli_w.dumps(data or changed()), encoding="utf-8")
    return path


def binding(bus: str, folder: Path) -> Path | None:
    match bus:
        case "own":
            return None
        case "drawn":
            return foreign(SEED).write(folder / "bus")
        case "two buses":
            return foreign(SEED, ("powertrain", "chassis")).write(folder / "bus")
    return superbike(folder)


def ridden(
    folder: Path,
    bound: Path | None,
    name: str = "throttle_sweep",
    excitation: dict[str, Any] | None = None,
    rider: dict[str, Any] | None = None,
    faults: FaultPlan | None = None,
) -> Ride:
    prepared = prepare(trial(folder, name, excitation or SHORT, rider or {}), None, bound)
    if faults is not None:
        prepared = replace(prepared, scenario=replace(prepared.scenario, faults=faults))
    return Ride(prepared, run_trial(prepared, folder / "run", None), folder / "run")


@cache
def sweep(bus: str) -> Ride:
    folder = Path(KEPT.name) / bus
    folder.mkdir()
    return ridden(folder, binding(bus, folder), excitation=SWEEP)


@cache
def identified(bus: str) -> Identification:
    return identify(read_run(sweep(bus).folder))


def commands(ride: Ride) -> list[tuple[float, ActuatorCommand]]:
    """Every command on the bus, with its time in s."""
    log, codec = read_log(ride.folder / "frames.log").frames, ride.prepared.binding.codec()
    found = []
    for index in range(len(log)):
        data = log.data[index, : log.length[index]].tobytes()
        bus = codec.buses.index(log.buses[log.bus[index]]) if any(codec.buses) else 0
        message = codec.decode(int(log.identifier[index]), data, False, bus)
        if isinstance(message, ActuatorCommand):
            found.append((log.time_ns[index] * 1e-9, message))
    return found


def tripped_at(ride: Ride) -> float:
    (found,) = [c.time_ns for c in ride.outcome.changes if c.phase is Phase.TRIPPED]
    return found * 1e-9


@pytest.mark.parametrize("bus", ["superbike", "drawn", "two buses"])
def test_a_sweep_rides_to_its_end(bus):
    ride = sweep(bus)
    assert ride.outcome.done, ride.outcome.trip
    assert ride.outcome.notes == ()
    assert ride.outcome.lateness.skipped == 0
    assert {c.phase for c in ride.outcome.changes} >= {Phase.ARMED, Phase.EXCITING, Phase.DONE}


def test_the_commands_on_a_drawn_database_are_those_on_our_own():
    """Within the steps of the signals: the position that holds the operating point is measured."""
    ours, theirs = commands(sweep("own")), commands(sweep("drawn"))
    assert [c.authority for _, c in theirs] == [c.authority for _, c in ours]
    codec = sweep("drawn").prepared.binding.codec()
    step = codec.parts("ActuatorCommand")[0].slot("throttle").scale
    opening = np.array([[c.throttle for _, c in each] for each in (ours, theirs)])
    assert np.ptp(opening[0]) > 0.03
    assert np.abs(opening[1] - opening[0]).max() < 3 * step + 1e-3


def test_the_resonance_is_that_of_the_motorcycle_on_every_bus():
    """7.6 Hz of this sweep with tooth times; sampled wheel speeds move it by their delay and noise."""
    found = {bus: identified(bus).resonance for bus in ("own", "drawn", "two buses", "superbike")}
    assert all(isinstance(each, Resonance) for each in found.values())
    for bus in ("drawn", "two buses"):
        assert found[bus].frequency == pytest.approx(found["own"].frequency, abs=0.05)
        assert found[bus].low_gain == pytest.approx(found["own"].low_gain, rel=0.02)
    assert found["superbike"].frequency == pytest.approx(found["own"].frequency, abs=0.5)
    assert found["superbike"].low_gain == pytest.approx(found["own"].low_gain, rel=0.1)


def test_the_run_of_a_degraded_bus_says_so(capsys):
    """In run.toml, in the summary and in the report, and no other run does."""
    words = "degraded mode: no tooth times"
    for bus, says in (("superbike", True), ("own", False)):
        run = sweep(bus).folder
        assert (words in (run / "run.toml").read_text(encoding="utf-8")) == says
        imported(identified(bus).recording)
        assert (words in " ".join(capsys.readouterr().out.split())) == says
        figures = key_figures(identified(bus), Study((), None, ()))
        assert any(words in each for each in figures["warnings"]) == says


def test_the_record_shows_an_enumeration_as_the_trial_understood_it(tmp_path):
    """Other raw values for the same authority: 3 = none, 1 = throttle."""
    data = changed()
    swapped = {"3": "none", "1": "throttle", "2": "spark", "0": "both"}
    for role in ("authority", "authority_request"):
        data["roles"][role]["values"] = swapped
    ride = ridden(tmp_path, superbike(tmp_path, data))
    assert ride.outcome.done, ride.outcome.trip
    channels = read_run(ride.folder).channels
    for role in ("authority", "authority_request"):
        assert set(channels[role].value) == {float(Authority.NONE), float(Authority.THROTTLE)}


@pytest.mark.parametrize("bus", ["superbike", "drawn", "two buses"])
def test_slip_control_rides_to_its_end(bus, tmp_path):
    ride = ridden(
        tmp_path,
        binding(bus, tmp_path),
        "slip_steps_throttle",
        {"duration": "2 s", "frequency": "1 Hz"},
        {"presses_button_after": "2 s"},
    )
    assert ride.outcome.done, ride.outcome.trip
    openings = [c.throttle for _, c in commands(ride) if c.authority]
    assert np.ptp(openings) > 0.002


@pytest.mark.parametrize("bus", ["superbike", "drawn"])
def test_a_sweep_of_the_spark_rides_to_its_end(bus, tmp_path):
    ride = ridden(
        tmp_path, binding(bus, tmp_path), "spark_sweep", {"duration": "1 s", "stop": "5 Hz"}
    )
    assert ride.outcome.done, ride.outcome.trip
    held = [c for _, c in commands(ride) if c.authority]
    assert {c.authority for c in held} == {Authority.SPARK}
    assert np.ptp([c.spark for c in held]) > 0.05


def variant(*roles: str, **entries: Any) -> dict[str, Any]:
    """The superbike's binding without roles, with entries of [degraded]."""
    changes = {f"degraded__{key}": value for key, value in entries.items()}
    return changed(*(f"roles.{role}" for role in roles), **changes)


AUTHORITY = ("authority", "authority_request")
VARIANTS = {
    "no optical speed": variant("optical_speed", speed="front_wheel"),
    "no echo": variant("throttle_command", echo="5 ms"),
    "no authority": variant(*AUTHORITY, hand_back="20 ms"),
    "no statement of the throttle body": variant("throttle_authority", throttle_body="follows_ecu"),
    "hardly anything": variant(
        *AUTHORITY,
        "optical_speed",
        "throttle_command",
        "spark_command",
        "throttle_authority",
        "throttle_fault",
        "gear",
        "clutch",
        "front_brake_pressure",
        "rear_brake_pressure",
        speed="front_wheel",
        echo="5 ms",
        hand_back="20 ms",
        throttle_body="follows_ecu",
        unmonitored=["gear", "clutch", "brake", "throttle_fault"],
    ),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_a_bus_that_lacks_something_carries_a_trial(name, tmp_path):
    ride = ridden(tmp_path, superbike(tmp_path, VARIANTS[name]))
    assert ride.outcome.done, ride.outcome.trip
    assert np.ptp([c.throttle for _, c in commands(ride) if c.authority]) > 0.01


@pytest.mark.parametrize("fault", ["silent ECU", "released button"])
@pytest.mark.parametrize("name", VARIANTS)
def test_a_fault_gives_the_throttle_back_on_a_bus_that_lacks_something(name, fault, tmp_path):
    rider, faults = {"holds_button_for": "300 ms"}, None
    if fault == "silent ECU":
        rider = {}
        faults = FaultPlan((Lost(1.0, Where(begin=SILENT_FROM, identifiers=ECM)),))
    ride = ridden(tmp_path, superbike(tmp_path, VARIANTS[name]), rider=rider, faults=faults)
    assert not ride.outcome.done
    assert ("ECU" in fault) == ("stale" in ride.outcome.trip or "silent" in ride.outcome.trip)
    sent, trip = commands(ride), tripped_at(ride)
    codec = ride.prepared.binding.codec()
    assert any(c.authority for time, c in sent if time < trip)
    after = [c for time, c in sent if time > trip + 0.0015]
    if codec.requests_authority:
        assert after
        assert {c.authority for c in after} == {Authority.NONE}
    else:  # the end of the requests is the release
        assert after == []
