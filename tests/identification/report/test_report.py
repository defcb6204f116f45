"""The report stands alone, says what it could not do, and the command speaks to people."""

import json
import re
from dataclasses import replace

import pytest
import typer
from typer.testing import CliRunner

from slipbench.identification.commands import register, studied, write_report
from slipbench.identification.report.headline import headline
from slipbench.identification.response.from_folder import identified, identified_folder
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording import table_recording
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import BusFault
from tests.identification.synthetic_recording import Truth, recording

FAULTS = (BusFault("EcuStatus", "lost", 7, 2.5), BusFault("0x7ab", "unknown identifier", 41, 0.25))


def both(recording):
    found = identified(recording)
    return found, studied(found)


@pytest.fixture(scope="module")
def made():
    described = {
        "versions": {"slipbench": "1.2.3"},
        "run": {"database_sha256": "cafe"},
        "lateness": {"ran": 30000, "skipped": 2, "p50": 2e-7, "p99": 3e-6, "max": 0.004},
    }
    made = recording(Truth(noise=0.02, tooth_error=0.002))
    return replace(made, faults=FAULTS, frame_count=1000, description=described)


@pytest.fixture(scope="module")
def folder(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    write_report(*both(made), folder, folder / "figures")
    return folder


def test_the_report_needs_nothing_but_a_browser(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    outside = re.findall(r"""(?:src|href)\s*=\s*["'](?!#)([^"']+)|url\((?!#)([^)]+)\)""", text)
    assert outside == []
    assert not re.findall(r"<script[^>]*\ssrc=", text)
    assert not re.findall(r"\b(?:fetch|XMLHttpRequest|WebSocket|importScripts)\b", text)
    assert len(text) < 5e6
    assert "@import" not in text
    assert 'name="viewport"' in text
    assert "@media print" in text


def test_a_trial_that_the_bench_marked_invalid_is_said_to_be_in_the_first_sentences(made):
    found = identified(made)
    why = "40 ticks of 1000 with authority were more than 0.5 ms late and 3 skipped"
    outcome = {"valid": False, "invalid": why}
    late = replace(found, recording=replace(made, description={"outcome": outcome}))
    assert headline(late) == f"{headline(found)} The trial is marked invalid: {why}."


def test_the_first_sentence_gives_the_resonance_and_the_coherence(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    first = re.search(r"<h1>(.*?)</h1>", text).group(1)
    assert "resonance at 7.5\u00a0Hz" in first
    assert "coherence" in first


@pytest.mark.parametrize(
    "words",
    [
        "EcuStatus",
        "lost",
        "0x7ab",
        "1.2.3",
        "cafe",
        "rear_encoder",
        "rear_suspension_travel",
        "14127 rpm",
        "190.8 km/h",
        "1X",
        "skipped ticks",
        "Faded: coherence below 0.8 or 95 % interval wider than half the gain.",
        "Frequency response (independent bins) and fitted model, 95 % interval.",
        "selected by MDL; also plausible (AIC difference below 4):",
        "Residual test",
        "1X order reduced by",
    ],
)
def test_the_report_tells(folder, words):
    assert words in (folder / "report.html").read_text(encoding="utf-8")


def test_the_figures_are_written_on_request(folder):
    names = {path.name for path in (folder / "figures").iterdir()}
    assert {"overview.png", "response.png", "spectra.png", "model.png", "harmonics.png"} <= names


def test_the_key_figures_are_for_a_program_too(folder):
    found = json.loads((folder / "identification.json").read_text(encoding="utf-8"))
    assert found["resonance"]["frequency"] == pytest.approx(7.48, abs=0.1)
    assert found["coherence_min"] > 0.95
    assert found["clocks"]["ecu"]["drift_ppm"] == pytest.approx(30, abs=1)
    assert found["delays"]["encoder"] == pytest.approx(0.00234, rel=0.02)
    assert found["left_out"][0]["missing_roles"] == ["rear_suspension_travel"]


def test_the_model_has_intervals_and_they_contain_the_truth(folder):
    """Truth: 8 Hz, damping 0.25, 10 ms."""
    found = json.loads((folder / "identification.json").read_text(encoding="utf-8"))["models"][0]
    low, high = found["delay_interval"]
    assert low <= 0.010 <= high
    mode = min(found["modes"], key=lambda m: m["damping"])
    assert abs(mode["frequency"] - 8.0) < 4 * mode["frequency_deviation"]
    assert found["chi_square_ratio"] > 0
    text = (folder / "report.html").read_text(encoding="utf-8")
    for words in ("Dead time", "95 % interval", "degrees of freedom", "Drift below the band"):
        assert words in text


def test_the_same_recording_gives_the_same_report(made, tmp_path):
    texts = [
        write_report(*both(made), tmp_path / name, None).read_text(encoding="utf-8")
        for name in ("one", "two")
    ]
    assert texts[0] == texts[1]


def test_a_name_is_shown_and_never_run(made, tmp_path):
    odd = replace(made, faults=(BusFault("<b>x</b>", "lost", 1, 0.0),))
    text = write_report(*both(odd), tmp_path, None).read_text(encoding="utf-8")
    assert "<b>x</b>" not in text
    assert "&lt;b&gt;x&lt;/b&gt;" in text


def test_an_empty_recording_is_refused(made):
    with pytest.raises(InputError, match="no samples"):
        identified(replace(made, channels={}))


def test_a_trip_before_the_excitation_is_refused_with_its_reason(made):
    phase = made.channels["trial_phase"]
    idle = replace(phase, value=phase.value * 0 + Phase.TRIPPED)
    trip = replace(phase, role="trip_reason", value=phase.value * 0 + TripReason.BRAKE)
    channels = {**made.channels, "trial_phase": idle, "trip_reason": trip}
    with pytest.raises(InputError, match="the rider braked"):
        identified(replace(made, channels=channels))


def test_a_recording_without_a_wheel_still_gets_a_report(made, tmp_path):
    few: dict[str, Channel] = {"engine_speed": made.channels["engine_speed"]}
    found = identified(replace(made, channels=few, trial=None))
    text = write_report(found, studied(found), tmp_path, None).read_text(encoding="utf-8")
    assert "optical_speed" in text or "rear_teeth" in text
    assert "Slip cannot be computed" in text


def command(monkeypatch, made, *arguments):
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    monkeypatch.setattr(table_recording, "read_recording", lambda run: made)
    return CliRunner().invoke(app, ["identify", *map(str, arguments)])


def test_the_command_prints_the_key_figures_and_where_the_report_is(made, tmp_path, monkeypatch):
    result = command(monkeypatch, made, "run", "--out", tmp_path / "o")
    assert result.exit_code == 0
    assert f"report: {tmp_path / 'o' / 'report.html'}" in result.output
    for word in ("Resonance", "Coherence", "Slip", "Faulty frames"):
        assert word in result.output


def test_help_has_an_example(made, monkeypatch):
    assert "slipbench identify runs/" in command(monkeypatch, made, "--help").output


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(InputError):
        identified_folder(tmp_path / "nothing")
    with pytest.raises(InputError):
        identified_folder(tmp_path)


def test_a_place_that_cannot_be_written_is_said(made, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_report(*both(made), tmp_path / "file", None)
