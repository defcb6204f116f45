"""The how-to pages run as written, on the simulated clock; what needs a bus or a device is listed."""

import shutil
from pathlib import Path

import pytest

from tests.hil.device import missing
from tests.how_to.page import Reader, agrees, blocks
from tests.identification.mismatch.callables.fmus.building import build, needs_compiler, recorded
from tests.paths import ROOT


@pytest.fixture
def reader(tmp_path: Path) -> Reader:
    folder = tmp_path / "folder"
    folder.mkdir()
    return Reader(folder)


def test_first_trial(reader: Reader) -> None:
    reader.follow("first_trial.md")
    assert reader.skipped == set()


def test_a_day_at_the_track(reader: Reader) -> None:
    reader.follow("a_day_at_the_track.md")
    assert reader.skipped == set()


def test_a_season(reader: Reader) -> None:
    pytest.importorskip("duckdb", reason="pip install 'slipbench[analysis]'")
    reader.follow("a_season.md")
    assert reader.skipped == set()


def test_export_to_rusefi(reader: Reader) -> None:
    pytest.importorskip("lupa", reason="pip install 'slipbench[ecu]'")
    reader.follow("export_to_rusefi.md")
    assert reader.skipped == set()


def test_your_motorcycle(reader: Reader) -> None:
    reader.follow("your_motorcycle.md")
    assert reader.skipped == {"can0"}


def test_your_recordings(reader: Reader) -> None:
    reader.follow("your_recordings.md")
    assert reader.skipped == set()


def test_your_ecu(reader: Reader) -> None:
    if lacks := missing():
        pytest.skip(f"gcc and make are needed: {lacks}")
    shutil.copytree(ROOT / "examples" / "hil", reader.folder / "examples" / "hil")
    reader.follow("your_ecu.md")
    assert reader.skipped == {"vcan0"}  # make hil runs these: tests/hil/inside/test_how_to.py


def test_streams_of_the_live_view(reader: Reader) -> None:
    for library in ("foxglove", "mcap"):
        pytest.importorskip(library, reason="pip install 'slipbench[view,foxglove,mdf]'")
    reader.follow("live_view.md", "Foxglove, Lichtblick, PlotJuggler")


@needs_compiler
def test_explain_your_simulation(reader: Reader) -> None:
    build(reader.folder, 3)
    (reader.folder / "runs").mkdir()
    for name, seed in (("one", 1), ("two", 2)):
        recorded(reader.folder / "runs", seed).rename(reader.folder / "runs" / name)
    reader.follow("explain_your_simulation.md")
    assert reader.skipped == set()


@needs_compiler
def test_export_an_fmu(reader: Reader) -> None:
    pytest.importorskip("fmpy", reason="pip install 'slipbench[fmu]'")
    reader.follow("export_an_fmu.md")
    assert reader.skipped == set()


def test_explain_a_mujoco_model(reader: Reader) -> None:
    pytest.importorskip("mujoco", reason="pip install 'slipbench[mujoco]'")
    reader.follow("explain_a_mujoco_model.md")
    assert reader.skipped == set()


def test_a_page_that_fails_or_says_other_than_it_shows_fails(reader: Reader) -> None:
    reader._sh("mkdir here && cd here && echo gain 7.9 Hz\n")
    assert reader.at == reader.folder / "here"
    reader._text("...\ngain 7.8 Hz\n")
    for wrong in ("gain 9 Hz\n", "loss 7.9 Hz\n", "gain 7.9 Hz\nmore\n"):
        with pytest.raises(AssertionError):
            reader._text(wrong)
    with pytest.raises(AssertionError):
        reader._sh("false\necho after")


def test_numbers_agree_within_a_tolerance_and_words_exactly() -> None:
    assert agrees("  Peak   +5.8 dB", "Peak +5.7 dB")
    assert not agrees("Peak +5.8 dB", "Peak +6.8 dB")
    assert not agrees("Peak +5.8 dB", "Peak 5.8 dB at 7")
    assert not agrees("run-001", "run-002")


@pytest.mark.parametrize(
    "page",
    [
        "first_trial.md",
        "a_day_at_the_track.md",
        "a_season.md",
        "your_motorcycle.md",
        "your_recordings.md",
        "your_ecu.md",
    ],
)
def test_every_block_of_a_page_is_of_a_language_that_the_runner_knows(page: str) -> None:
    assert {block.language for block in blocks(page)} <= {"sh", "text", "toml", "python"}
