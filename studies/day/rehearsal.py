"""The day, step by step, with the commands that an engineer types.

plan        trials that fit into the straight, simulated with margin
session     eight runs; one trips, one is bad: both are repeated. Then explain: simulation against
            recordings; the trial designed for what that left open is accepted, ridden, explained
design      a slip controller from the recorded runs
trial       the controller, ridden; identify: its report
"""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import tomli_w

from slipbench.plant.vehicles import DEMONSTRATION, NOMINAL
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.output_folders import make_folders
from slipbench.studies.day.mishaps import record, silent_sensors, soft_tyre
from slipbench.studies.day.transcript import kept

STRAIGHT = "900m"
REPEATS = 4  # of two trials: eight runs
TRIPPED, BAD = "throttle_response-2", "spark_response-3"
DESIGNED = 1  # trials that are offered: each one takes an analysis more
Say = Callable[[str], None]


@dataclass(frozen=True)
class Day:
    """Folder of the day, and who receives its lines. nominal: vehicle file before the day."""

    folder: Path
    say: Say
    nominal: Path = NOMINAL

    @property
    def plan(self) -> Path:
        """The session plan."""
        return self.folder / "day.toml"

    @property
    def session(self) -> Path:
        """Folder of the session."""
        return self.folder / "session"

    @property
    def pages(self) -> dict[str, Path]:
        """Pages of the day, by name."""
        return {
            "day_report": self.session / "report.html",
            "day_memo": self.session / "memo" / "memo.html",
            "day_controller": self.folder / "controller" / "design.html",
            "day_slip_control": self.folder / "slip_steps" / "report.html",
        }


def rehearse(day: Day) -> None:
    """Rehearse the whole day into its folder. Raises InputError where a step fails or it is not empty."""
    if day.folder.exists() and any(day.folder.iterdir()):
        raise InputError(
            "the folder is not empty", where=str(day.folder), remedy="give a new folder"
        )
    make_folders(day.folder)
    day = replace(day, say=kept(day.folder, day.say))
    plan(day)
    day.say("-- something goes wrong in two of the runs: a loose connector, a tyre without air")
    record(day.plan, day.session, (silent_sensors(TRIPPED), soft_tyre(BAD)))
    run_session(day)
    control(day)


def plan(day: Day) -> None:
    """Propose the plan of eight runs."""
    questions = "throttle_response,spark_response"
    _slipbench(
        day,
        "plan",
        DEMONSTRATION,
        "--straight",
        STRAIGHT,
        "--questions",
        questions,
        "--out",
        day.plan,
    )
    text = day.plan.read_text(encoding="utf-8")
    day.plan.write_text(re.sub(r"repeats = \d+", f"repeats = {REPEATS}", text), encoding="utf-8")


def run_session(day: Day) -> None:
    """Run what is planned, explain it, ride the designed trial, explain again, write the report."""
    arguments = ("--out", day.session, "--simulate", "--explain", day.nominal)
    designed = ("--straight", STRAIGHT, "--offers", DESIGNED, "--accept")
    _slipbench(day, "session", day.plan, *arguments, *designed)


def control(day: Day) -> None:
    """Design a slip controller from the usable runs of the day and ride it."""
    runs = [day.session / "runs" / f"throttle_response-{n}" for n in (1, 3, 4)]
    controller = day.folder / "controller.toml"
    report = day.folder / "controller"
    _slipbench(
        day, "design", *runs, "--actuator", "throttle", "--out", controller, "--report", report
    )
    trial, run = day.folder / "slip_steps.toml", day.folder / "slip_steps"
    trial.write_text(tomli_w.dumps(_slip_steps(day, controller)), encoding="utf-8")
    _slipbench(day, "trial", trial, "--out", run)
    _slipbench(day, "identify", run)


def _slip_steps(day: Day, controller: Path) -> dict[str, object]:
    """Trial file of steps of the slip about the operating point of the day, in its limits."""
    tree = load_toml(day.session / "trials" / "throttle_response-1.toml")
    excitation = {
        "actuator": "slip",
        "waveform": "square",
        "amplitude": "0.1 %",
        "frequency": "0.5 Hz",
        "duration": "8 s",
    }
    return {
        **tree,
        "name": "slip_steps",
        "description": "Steps of the slip under control",
        "vehicle": os.path.relpath(DEMONSTRATION, day.folder),
        "excitation": excitation,
        "controller": {"file": controller.name},
        "rider": {"presses_button_after": "5 s"},
    }


def _slipbench(day: Day, *arguments: object) -> None:
    """Run a command in a process of its own. Raises InputError where it fails."""
    shown = " ".join(_short(day, str(a)) for a in arguments)
    day.say(f"$ slipbench {shown}")
    command = [sys.executable, "-m", "slipbench", *map(str, arguments)]
    began = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        day.say(line.rstrip("\n"))
    status = process.wait()
    day.say(f"# {time.monotonic() - began:.0f} s")
    if status:
        raise InputError(
            "a step of the day failed", where=f"slipbench {shown}", found=f"status {status}"
        )


def _short(day: Day, text: str) -> str:
    """An argument as an engineer in the folder of the day types it."""
    return os.path.relpath(text, day.folder) if text.startswith(str(day.folder)) else text
