"""How close identification comes to motorcycles whose truth is known.

`python benchmarks/accuracy.py [seeds] [--out docs/accuracy.md]` rides, identifies and compares.
Nothing of the truth is given but what the goals say: filling time and c / k of the driveline are
taken as known for the delay alone. The order is found, not given. Seeds from 300 000 on had no part
in any choice; the motorcycles that are drawn had none either.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rides import drawn, driveline, estimated, linear, ride, truth, vehicle

from identification.models.delay_profile import DelayProfile, delay_profile
from identification.models.model_order import all_pole, choose_order
from identification.models.rational_ml import ACROSS, RationalFit
from identification.paper.rational_trial import known_path
from identification.response.independent_lines import Lines, independent_lines, without
from identification.response.response import FrequencyResponse

SEEDS, FIRST = 200, 300_000
RIDES_EACH = 10  # of one drawn motorcycle
COHERENT = 0.95
PROFILED = 4  # every so many rides the delay is profiled: it takes longer than the ride
POINTS = 16


@dataclass(frozen=True)
class Case:
    """Rides of one kind. kind: linear, drawn, whole; noise: 1 is the virtual bench's."""

    title: str
    kind: str
    vehicle: str
    noise: float
    lasts: float
    share: float  # of the seeds


CASES = (
    Case("demonstration, linear", "linear", "demonstration", 0.1, 30.0, 0.2),
    Case("demonstration, linear", "linear", "demonstration", 0.3, 30.0, 0.2),
    Case("demonstration, linear", "linear", "demonstration", 1.0, 30.0, 1.0),
    Case("demonstration, linear", "linear", "demonstration", 3.0, 30.0, 0.2),
    Case("demonstration, linear", "linear", "demonstration", 1.0, 60.0, 0.2),
    Case("nominal", "linear", "nominal", 1.0, 30.0, 0.2),
    Case("drawn about nominal", "drawn", "nominal", 1.0, 30.0, 1.0),
    Case("demonstration, all effects", "whole", "demonstration", 1.0, 30.0, 0.2),
)


@dataclass(frozen=True)
class Outcome:
    """One ride against the truth.

    lines, model   (n, 2) errors of gain (%) and phase (degrees) where coherence exceeds 0.95
    coherent       share of the lines where it does
    driveline      errors of frequency and damping, %
    delay          estimate less truth, and the interval's ends less it, ms; NaN where none is told
    held           whether or how often 95 % intervals hold: lines, model, frequency, damping, delay
    ratio          chi-square over its degrees of freedom
    """

    lines: np.ndarray
    model: np.ndarray
    coherent: float
    driveline: tuple[float, float]
    delay: tuple[float, float, float]
    held: tuple[float, float, float, float, float]
    ratio: float


def motorcycle_of(case: Case, seed: int):
    """Give the motorcycle of one ride."""
    if case.kind == "drawn":
        return drawn(case.vehicle, FIRST + (seed - FIRST) // RIDES_EACH)
    return vehicle(case.vehicle).motorcycle if case.kind == "whole" else linear(case.vehicle)


def outcome(job: tuple[Case, int]) -> Outcome | None:
    """Ride once and compare; None where the recording carries no model."""
    case, seed = job
    motorcycle = motorcycle_of(case, seed)
    response = estimated(ride(motorcycle, case.noise, seed, case.lasts))
    lines = independent_lines(response)
    if not isinstance(lines, Lines):
        return None
    return judged(response, lines, motorcycle, seed % PROFILED == 0)


def judged(response: FrequencyResponse, lines: Lines, motorcycle, profiled: bool) -> Outcome:
    """Compare one response with the truth. The model is the report's: a chain, order by MDL."""
    at = truth(motorcycle)
    fit = choose_order(lines, all_pole()).best_by_mdl.fit
    inside = (response.frequency >= lines.frequency[0]) & (
        response.frequency <= lines.frequency[-1]
    )
    good = inside & (response.coherence > COHERENT)
    f = response.frequency[good]
    off, held = _driveline(fit, motorcycle)
    delay, told = _delay(lines, motorcycle) if profiled else ((np.nan,) * 3, np.nan)
    g, true = lines.frequency, np.abs(at(lines.frequency))
    own = np.isin(response.frequency, g)
    return Outcome(
        _errors(response.value[good] / at(f)), _errors(fit.response(f) / at(f)),
        float(np.mean(good[inside])), off, delay,
        (
            float(np.mean(np.abs(np.abs(lines.value) - true) < response.gain_band[own])),
            float(np.mean(np.abs(np.abs(fit.response(g)) - true) < fit.band(g))), *held, told,
        ), fit.chi_square_ratio,
    )  # fmt: skip


def _errors(ratio: np.ndarray) -> np.ndarray:
    return np.stack((100 * np.abs(np.abs(ratio) - 1), np.degrees(np.abs(np.angle(ratio)))), axis=1)


def _driveline(fit: RationalFit, motorcycle) -> tuple[tuple[float, float], tuple[float, float]]:
    """Errors in % of the least damped mode inside the band, and whether the intervals hold.

    NaN where the true driveline swings beyond the last line: no recording shows it there.
    """
    frequency, damping = driveline(motorcycle)
    top = fit.lines.frequency[-1]
    if not frequency < top:
        return (np.nan, np.nan), (np.nan, np.nan)
    mode = min(fit.modes, key=lambda m: (m.frequency > top, m.damping))
    off = (mode.frequency - frequency, mode.damping - damping)
    held = (
        float(abs(off[0]) < ACROSS * mode.frequency_deviation),
        float(abs(off[1]) < ACROSS * mode.damping_deviation),
    )
    return (100 * abs(off[0]) / frequency, 100 * abs(off[1]) / damping), held


def _delay(lines: Lines, motorcycle) -> tuple[tuple[float, float, float], float]:
    """Error of the delay and its interval, ms, and whether that holds it; NaN: none told."""
    true = 1e3 * motorcycle.intake.delay
    rest = without(lines, known_path(motorcycle))
    profile = delay_profile(choose_order(rest, all_pole()), points=POINTS)
    if not isinstance(profile, DelayProfile):
        return (np.nan, np.nan, np.nan), np.nan
    told = tuple(1e3 * d - true for d in (profile.delay, profile.low, profile.high))
    return told, float(told[1] <= 0 <= told[2])


@dataclass(frozen=True)
class Row:
    """A case and what all its rides gave."""

    case: Case
    seeds: int
    outcomes: list[Outcome]

    def errors(self, what: str, column: int) -> np.ndarray:
        """All errors of one kind."""
        return np.concatenate([getattr(o, what)[:, column] for o in self.outcomes])

    @property
    def held(self) -> np.ndarray:
        """How often intervals hold, %, (5,)."""
        return 100 * np.nanmean([o.held for o in self.outcomes], axis=0)

    @property
    def late(self) -> np.ndarray:
        """Errors of the delay, ms, where it was profiled and told."""
        found = np.abs([o.delay[0] for o in self.outcomes])
        return np.asarray(found[np.isfinite(found)])

    @property
    def driveline(self) -> np.ndarray:
        """Errors of frequency and damping, %, (m, 2), where the driveline swings in the band."""
        found = np.array([o.driveline for o in self.outcomes])
        return np.asarray(found[np.isfinite(found[:, 0])])


def rows(seeds: int, cases: tuple[Case, ...] = CASES, workers: int = 2) -> list[Row]:
    """Ride every case."""
    made = []
    with ProcessPoolExecutor(workers) as pool:
        for case in cases:
            count = max(4, round(case.share * seeds))
            jobs = [(case, FIRST + k) for k in range(count)]
            found = [o for o in pool.map(outcome, jobs, chunksize=RIDES_EACH) if o is not None]
            made.append(Row(case, count, found))
    return made


HEAD = ("motorcycle", "sweep", "noise", "rides")


def _cells(row: Row) -> tuple[str, ...]:
    refused = row.seeds - len(row.outcomes)
    rides = f"{len(row.outcomes)}" + (f" ({refused} refused)" if refused else "")
    return (row.case.title, f"{row.case.lasts:g} s", f"{row.case.noise:g}", rides)


def error_cells(row: Row) -> tuple[str, ...]:
    """Errors of one case."""
    p = np.percentile
    cells = [f"{100 * np.mean([o.coherent for o in row.outcomes]):.0f}"]
    for what in ("lines", "model"):
        gain, phase = row.errors(what, 0), row.errors(what, 1)
        within = 100 * np.mean((gain < 1) & (phase < 1))
        cells += [f"{p(gain, 50):.2f}, {p(gain, 95):.2f}", f"{p(phase, 95):.2f}", f"{within:.0f}"]
    swings, late = row.driveline, row.late
    cells.append(f"{len(swings)}")
    if not len(swings) or not late.size:
        return (*_cells(row), *cells, *("–",) * 6)
    cells.append(", ".join(f"{x:.2f}" for x in p(swings[:, 0], (50, 95))))
    cells.append(f"{100 * np.mean(swings[:, 0] < 2):.0f}")
    cells.append(", ".join(f"{x:.2f}" for x in p(swings[:, 1], (50, 95))))
    cells += [f"{late.size}", f"{np.median(late):.2f}, {p(late, 95):.1f}"]
    cells.append(f"{100 * np.mean(late < 1):.0f}")
    return (*_cells(row), *cells)


ERRORS = (
    *HEAD, "coherent lines, %",
    "lines: gain p50, p95, %", "phase p95, °", "within 1 % and 1°, %",
    "model: gain p50, p95, %", "phase p95, °", "within 1 % and 1°, %",
    "drivelines in band", "frequency p50, p95, %", "within 2 %, %", "damping p50, p95, %",
    "delays", "p50, p95, ms", "within 1 ms, %",
)  # fmt: skip
COVERED = (*HEAD, "lines", "model", "driveline frequency", "driveline damping", "delay",
           "chi-square / dof")  # fmt: skip


def covered_cells(row: Row) -> tuple[str, ...]:
    """Coverage of one case."""
    ratio = float(np.mean([o.ratio for o in row.outcomes]))
    return (*_cells(row), *(f"{x:.1f}" for x in row.held), f"{ratio:.2f}")


def table(head: tuple[str, ...], cells: list[tuple[str, ...]]) -> str:
    """Lay a table out as Markdown."""
    lines = [head, tuple("---" for _ in head), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def goals(made: list[Row]) -> str:
    """Say of every goal where it is met and where it is not, from the figures themselves."""
    said = []
    for name, value, least, most in (
        ("lines within 1 % and 1 degree", lambda r: _both(r, "lines"), 95.0, 100.0),
        ("model within 1 % and 1 degree", lambda r: _both(r, "model"), 95.0, 100.0),
        ("driveline's frequency within 2 %",
         lambda r: 100 * np.mean(r.driveline[:, 0] < 2), 95.0, 100.0),
        ("delay within 1 ms", lambda r: 100 * np.mean(r.late < 1), 95.0, 100.0),
        *((f"interval of {what} holds", lambda r, k=k: r.held[k], 90.0, 98.0)
          for k, what in enumerate(("lines", "the model", "driveline frequency",
                                    "driveline damping", "the delay"))),
    ):  # fmt: skip
        figures = [float(value(row)) for row in made]
        missed = [
            f"{row.case.title}, {row.case.lasts:g} s, noise {row.case.noise:g} ({figure:.0f} %)"
            for row, figure in zip(made, figures, strict=True)
            if not least <= figure <= most
        ]
        said.append(
            f"- {name}, in {least:g} to {most:g} %: met in {len(made) - len(missed)} of "
            f"{len(made)} rows" + (f"; missed: {'; '.join(missed)}" if missed else "")
        )
    return "\n".join(said)


def _both(row: Row, what: str) -> float:
    return float(100 * np.mean((row.errors(what, 0) < 1) & (row.errors(what, 1) < 1)))


def document(made: list[Row], notes: str) -> str:
    """Compose the page."""
    return (
        "# Accuracy against known truth\n\n"
        "Written by `make accuracy` (`benchmarks/accuracy.py`). One throttle sweep of 2 % from 0.5 "
        f"to 12 Hz a ride, seeds from {FIRST} on, which had no part in any choice. Noise 1 is the "
        "virtual bench's: optical speed 0.02 m/s and 0.01 m/s steps, throttle 0.03 %, combustion "
        "0.8 N m, gusts of 12 N. Drawn motorcycles: one for ten rides, from what the nominal file "
        "believes.\n\n"
        "## Errors\n\nLines: the nonparametric response; model: the report's rational function, "
        "its order found, nothing known. p50, p95: percentiles over lines and rides. Drivelines "
        "count where they swing below the last line. The delay of every fourth ride is profiled, "
        "filling time and c / k taken as known.\n\n"
        f"{table(ERRORS, [error_cells(r) for r in made])}\n\n"
        "## How often 95 % intervals hold the truth, %\n\n"
        f"{table(COVERED, [covered_cells(r) for r in made])}\n\n## Goals\n\n"
        "A goal counts as met where 95 % of the cases are within it, an interval where it holds "
        f"in 90 to 98 %.\n\n{goals(made)}\n{notes}"
    )


MARK = "\n## Causes"  # what is written by hand from here on is kept


def main() -> None:
    """Ride, and print or write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="?", default=20)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    made = rows(given.seeds)
    if given.out is None:
        print(document(made, ""))
        return
    old = given.out.read_text(encoding="utf-8") if given.out.exists() else ""
    notes = old[old.index(MARK) :] if MARK in old else "\n"
    given.out.write_text(document(made, notes), encoding="utf-8")


if __name__ == "__main__":
    main()
