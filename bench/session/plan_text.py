"""A proposed session plan as commented text, with its trial files beside it."""

from collections.abc import Sequence
from pathlib import Path

import tomli_w

from slipbench.bench.session.proposal import Proposed
from slipbench.protocol.new_file import new_file, refuse_existing
from slipbench.protocol.straight import BEFORE, BRAKING, MARGIN, WINDOW
from slipbench.protocol.trial_file import RPM


def folder_of(plan: Path) -> Path:
    """Folder of the trial files of a proposed plan."""
    return plan.with_name(f"{plan.stem}_trials")


def write_plan(proposed: Sequence[Proposed], plan: Path, vehicle: Path, straight: float) -> None:
    """Write the plan and its trial files. Raises InputError where one of them exists already."""
    folder = folder_of(plan)
    files = {folder / f"{one.name}.toml": _trial_text(one) for one in proposed}
    for path in (plan, *files):
        refuse_existing(path)
    for path, text in {**files, plan: plan_text(proposed, plan, vehicle, straight)}.items():
        with new_file(path) as draft:
            draft.write_text(text, encoding="utf-8")


def _trial_text(one: Proposed) -> str:
    head = (
        "# Proposed by slipbench plan, and simulated: it ends with"
        f" {MARGIN:.0%} of each range left.\n# Review the limits with the rider.\n\n"
    )
    return head + tomli_w.dumps(dict(one.file))


def plan_text(proposed: Sequence[Proposed], plan: Path, vehicle: Path, straight: float) -> str:
    """Text of the plan file."""
    at, fitting = proposed[0].point, proposed[0].fitting
    laps = sum(one.question.repeats for one in proposed)
    rpm = fitting.engine_speed / RPM
    lines = [
        f"# Session plan for {vehicle.name} on a straight of {straight:g} m, with {laps} laps.",
        f"# Operating point: gear {fitting.gear}, {rpm:.0f} rpm, {3.6 * fitting.speed:.0f} km/h.",
        f"# The straight holds {BEFORE:g} s before the button, {fitting.distance:.0f} m for the trial,",
        f"# and the way to brake at {BRAKING:g} m/s^2. It begins where the rider has that speed.",
        *([f"# Limit on the slip {at.slip:.0%}: {at.steady}."] if at.steady else []),
        "#",
        f"#   slipbench session {plan.name} --out {plan.stem} --simulate   rehearses it",
        "",
        f'name = "{plan.stem}"',
        f'description = "{fitting.gear}. gear at {rpm:.0f} rpm on {straight:g} m"',
        'order = "interleaved"   # one run of each trial in turn; "fixed": one trial after another',
        "attempts = 2            # at a run whose quick look asks for a repetition",
        "",
        "# [tags]                # go into every run; slipbench runs filters by them",
        '# track = "Mugello"',
        "# mileage = 812",
    ]
    for one in proposed:
        lines += ["", f"# {one.question.text}", *_trial_lines(one, folder_of(plan).name)]
    return "\n".join(lines) + "\n"


def _trial_lines(one: Proposed, folder: str) -> list[str]:
    rpm = one.fitting.engine_speed / RPM
    window = f'["{(1 - WINDOW) * rpm:.0f} rpm", "{(1 + WINDOW) * rpm:.0f} rpm"]'
    return [
        "[[trial]]",
        f'name = "{one.name}"',
        f'file = "{folder}/{one.name}.toml"   # excitation and limits',
        f"repeats = {one.question.repeats}",
        f"gear = {one.fitting.gear}",
        f"engine_speed = {window}   # at which the bench arms",
        f'amplitude = "{one.file["excitation"]["amplitude"]}"',
    ]
