"""Page of the accuracy study: tables, goals and manual notes."""

import numpy as np

from known.cases import FIRST
from known.rows import Row

HEAD = ("motorcycle", "sweep", "noise", "trials")


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
    driveline, late = row.driveline, row.late
    cells.append(f"{len(driveline)}")
    cells += (
        ["–"] * 3
        if not len(driveline)
        else [
            ", ".join(f"{x:.2f}" for x in p(driveline[:, 0], (50, 95))),
            f"{_share(driveline[:, 0] < 2):.0f}",
            ", ".join(f"{x:.2f}" for x in p(driveline[:, 1], (50, 95))),
        ]
    )
    cells.append(f"{late.size}")
    cells += (
        ["–"] * 2
        if not late.size
        else [f"{np.median(late):.2f}, {p(late, 95):.1f}", f"{_share(late < 1):.0f}"]
    )
    return (*_cells(row), *cells)


ERRORS = (
    *HEAD,
    "coherent bins, %",
    "bins: gain p50, p95, %",
    "phase p95, °",
    "within 1 % and 1°, %",
    "model: gain p50, p95, %",
    "phase p95, °",
    "within 1 % and 1°, %",
    "resonances in band",
    "frequency p50, p95, %",
    "within 2 %, %",
    "damping p50, p95, %",
    "dead times",
    "p50, p95, ms",
    "within 1 ms, %",
)
COVERED = (
    *HEAD,
    "bins",
    "model",
    "driveline frequency",
    "driveline damping",
    "dead time",
    "chi-square / dof",
)


def covered_cells(row: Row) -> tuple[str, ...]:
    """Coverage of one case."""
    ratio = float(np.mean([o.ratio for o in row.outcomes]))
    held = ("–" if np.isnan(x) else f"{x:.1f}" for x in row.held)
    return (*_cells(row), *held, f"{ratio:.2f}")


def table(head: tuple[str, ...], cells: list[tuple[str, ...]]) -> str:
    """A table as Markdown."""
    lines = [head, tuple("---" for _ in head), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def goals(made: list[Row]) -> str:
    """For each goal the cases that meet it and those that do not, computed from the figures."""
    said = []
    for name, value, least, most in (
        ("bins within 1 % and 1 degree", lambda r: _both(r, "lines"), 95.0, 100.0),
        ("model within 1 % and 1 degree", lambda r: _both(r, "model"), 95.0, 100.0),
        ("driveline frequency within 2 %", lambda r: _share(r.driveline[:, 0] < 2), 95.0, 100.0),
        ("dead time within 1 ms", lambda r: _share(r.late < 1), 95.0, 100.0),
        *(
            (f"coverage of the interval, {what}", lambda r, k=k: r.held[k], 90.0, 98.0)
            for k, what in enumerate(
                ("bins", "model", "driveline frequency", "driveline damping", "dead time")
            )
        ),
    ):
        figures = [(row.case, float(value(row))) for row in made]
        identified = [(case, share) for case, share in figures if np.isfinite(share)]
        missed = [
            f"{case.title}, {case.lasts:g} s, noise {case.noise:g} ({share:.1f} %)"
            for case, share in identified
            if not least <= share <= most
        ]
        said.append(
            f"- {name}, in {least:g} to {most:g} %: met in {len(identified) - len(missed)} of "
            f"{len(identified)} rows" + (f"; missed: {'; '.join(missed)}" if missed else "")
        )
    return "\n".join(said)


def _share(within: np.ndarray) -> float:
    return 100 * float(np.mean(within)) if within.size else float("nan")


def _both(row: Row, what: str) -> float:
    return float(100 * np.mean((row.errors(what, 0) < 1) & (row.errors(what, 1) < 1)))


def document(made: list[Row], notes: str) -> str:
    """The page as Markdown."""
    return (
        "# Accuracy against known truth\n\n"
        "Written by `make accuracy` (`benchmarks/accuracy.py`). Each trial is a simulated throttle sweep of 2 % "
        f"from 0.5 to 12 Hz; the seeds start at {FIRST} and were used for no other choice. Noise 1 is "
        "that of the virtual bench: optical speed 0.02 m/s with a resolution of 0.01 m/s, throttle "
        "0.03 %, combustion 0.8 N m, gusts of 12 N. Drawn motorcycles: parameters drawn from the "
        "tolerances of the nominal file, one motorcycle per ten trials. The truth is the response at "
        "the mean speed of the trial: with noise 1, wind changes this speed by about 0.1 m/s between "
        "trials, and the gain decreases by 3 % per m/s.\n\n"
        "## Errors\n\nBins: nonparametric frequency response; model: transfer function of the report, "
        "order selected, no prior knowledge. p50, p95: percentiles over bins and trials. A driveline "
        "resonance counts where it lies below the highest bin. The dead time is profiled for every "
        "fourth trial, with filling time and c / k known.\n\n"
        f"{table(ERRORS, [error_cells(r) for r in made])}\n\n"
        "## Coverage of the 95 % intervals, %\n\n"
        f"{table(COVERED, [covered_cells(r) for r in made])}\n\n## Goals\n\n"
        "A goal is met where 95 % of the cases are within it; an interval where its coverage is 90 to "
        f"98 %.\n\n{goals(made)}\n{notes}"
    )
