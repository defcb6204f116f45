"""A day's runs from their quick looks: pooled responses, throttle against spark, what to do next."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from slipbench.identification.models.actuator_comparison import (
    Comparison,
    NoComparison,
    answer,
    compare_actuators,
)
from slipbench.identification.response.response import FrequencyResponse, reliable_band
from slipbench.identification.session.measures import response_from, response_tree
from slipbench.identification.session.pooled import pooled

REPEAT, OTHER = "repeat", "other amplitude"


@dataclass(frozen=True)
class Run:
    """A run of a session: names of trial and run folder, and the content of its quick look."""

    trial: str
    name: str
    look: Mapping[str, Any]

    @property
    def usable(self) -> bool:
        """Whether the quick look lets it count."""
        return bool(self.look.get("counts"))


@dataclass(frozen=True)
class Day:
    """All runs of a session.

    planned      number of runs of the plan
    incomplete   names of interrupted recordings, which are kept
    explained    content of verdict.json; None where `explain` did not run
    not_explained  why not, where it was to run; memo: path of the memo, relative to the report
    selected     runs of that analysis, each with its reason
    designed     trials that were offered, the decisions, and the evidence of their runs
    """

    name: str
    description: str
    planned: int
    runs: tuple[Run, ...]
    incomplete: tuple[str, ...] = ()
    explained: Mapping[str, Any] | None = None
    not_explained: str = ""
    memo: str = ""
    selected: tuple[str, ...] = ()
    designed: tuple[str, ...] = ()

    def of_trial(self, trial: str) -> tuple[Run, ...]:
        """Usable runs of a trial."""
        return tuple(run for run in self.runs if run.trial == trial and run.usable)

    @property
    def trials(self) -> tuple[str, ...]:
        """Names of the trials, in the order of their first runs."""
        return tuple(dict.fromkeys(run.trial for run in self.runs))


@dataclass(frozen=True)
class Pooled:
    """Response of a trial pooled over its usable runs."""

    trial: str
    point: str
    actuator: str
    runs: tuple[str, ...]
    response: FrequencyResponse


@dataclass(frozen=True)
class Results:
    """Results of a day's runs together."""

    pooled: tuple[Pooled, ...]
    against: Comparison | NoComparison
    next_steps: tuple[str, ...] = field(default=())


def results(day: Day) -> Results:
    """Responses pooled by trial, throttle against spark, and the next steps."""
    found = tuple(one for trial in day.trials if (one := _pooled(day, trial)) is not None)
    return Results(found, _against(found), tuple(_next_steps(day)))


def _pooled(day: Day, trial: str) -> Pooled | None:
    runs = [run for run in day.of_trial(trial) if run.look.get("response")]
    if not runs:
        return None
    first = runs[0].look
    return Pooled(
        trial,
        str(first.get("operating_point", "")),
        str(first.get("actuator", "")),
        tuple(run.name for run in runs),
        pooled([response_from(run.look["response"]) for run in runs]),
    )


def _against(found: tuple[Pooled, ...]) -> Comparison | NoComparison:
    """Throttle against spark at the first operating point that has both."""
    for throttle in found:
        for spark in found:
            if (throttle.actuator, spark.actuator) != ("throttle", "spark"):
                continue
            if throttle.point == spark.point:
                return compare_actuators(throttle.response, spark.response)
    return NoComparison("no operating point has usable runs of both throttle and spark")


def _next_steps(day: Day) -> list[str]:
    """Trials that remain, and the next trial of the menu where `explain` chose one."""
    steps = []
    for trial in day.trials:
        last = [run for run in day.runs if run.trial == trial][-1]
        if last.look.get("verdict") == OTHER:
            steps.append(
                f"{trial}: {last.look.get('reason', '')}. Add it to the plan under another name"
            )
        elif last.look.get("verdict") == REPEAT:
            steps.append(f"{trial}: {last.look['verdict']}: {last.look.get('reason', '')}")
        elif last.look.get("response") and len(day.of_trial(trial)) == 1:
            steps.append(f"{trial}: ride it again: one run shows no scatter between runs")
    proposed = (day.explained or {}).get("next_trial")
    if proposed:
        steps.append(f"next trial: {proposed['why']} (memo/next_trial.toml)")
    elif day.explained is None:
        steps.append("slipbench session --explain VEHICLE chooses the next trial of the menu")
    return steps


def headline(day: Day) -> str:
    """Result of the day in a sentence."""
    usable = sum(run.usable for run in day.runs)
    kept = len(day.incomplete)
    more = f"; {kept} interrupted recording{'s' if kept != 1 else ''} kept" if kept else ""
    return f"{usable} of {day.planned} planned runs are usable{more}."


def explanation(day: Day) -> str:
    """Result of `explain`, in a sentence."""
    if day.explained is None:
        return day.not_explained or "Not analysed: give the nominal vehicle file with --explain."
    if not day.explained["mismatch"].get("found"):
        return "No significant mismatch between the simulation and these runs was found."
    names = [str(effect["name"]).replace("_", " ") for effect in day.explained["effects"]]
    return f"Effects that the simulation lacks: {', '.join(names) or 'none of the library'}."


def figures(day: Day, found: Results) -> dict[str, Any]:
    """Contents of session.json: SI, frequencies in Hz."""
    against = found.against
    return {
        "name": day.name,
        "headline": headline(day),
        "planned": day.planned,
        "runs": [
            {"trial": run.trial, "run": run.name, **_without_response(run.look)} for run in day.runs
        ],
        "incomplete": list(day.incomplete),
        "pooled": [
            {
                "trial": one.trial,
                "operating_point": one.point,
                "runs": list(one.runs),
                "reliable_band": reliable_band(one.response),
                "response": response_tree(one.response),
            }
            for one in found.pooled
        ],
        "throttle_against_spark": (
            against.reason if isinstance(against, NoComparison) else answer(against)
        ),
        "explanation": explanation(day),
        "explained_runs": list(day.selected),
        "designed": list(day.designed),
        "next_steps": list(found.next_steps),
    }


def _without_response(look: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in look.items() if key not in ("response", "run", "trial")}
