"""Steps 4 and 5: the trials, and the harmonics of slip in them (figures 4, 6 and 10)."""

from slipbench.identification.report.report import Drawn
from slipbench.identification.response.describing_function import (
    DescribingFunction,
    NoHarmonics,
    sliced,
)
from slipbench.identification.response.harmonics import harmonics
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.swept_recording import swept_run_of
from slipbench.identification.response.swept_run import SweptRun
from slipbench.studies.paper import switched_figures
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.harmonic_claims import describing_function_claims
from slipbench.studies.paper.harmonic_figures import describing_figure
from slipbench.studies.paper.paper_section import Section, drawn

Harmonics = DescribingFunction | NoHarmonics


def trials(found: Found) -> Section:
    """Section on the sweep and step trials of both actuators."""
    throttle, steps = runs_of(found, "throttle")[0], runs_of(found, "steps")[0]
    spark, spark_steps = runs_of(found, "spark")[0], runs_of(found, "sparksteps")[0]
    return Section(
        "4",
        "Sweeps and steps",
        ("Requested and actual actuator position, and the response of slip.",),
        (
            *drawn(
                "trials_throttle",
                "Figure 4 of the paper: throttle.",
                lambda: switched_figures.trials_figure(throttle, steps),
            ),
            *drawn(
                "trials_spark",
                "As above, for the spark.",
                lambda: switched_figures.trials_figure(spark, spark_steps),
            ),
        ),
    )


def describing_functions(found: Found, context: Context) -> Section:
    """Section on the describing functions from sweeps."""
    throttle, spark = (_sweeps(runs_of(found, kind)) for kind in ("large", "spark"))
    from_throttle, from_spark = harmonics(throttle), harmonics(spark)
    return Section(
        "5",
        "Describing functions",
        (
            "Harmonics of slip relative to the amplitude of the reported command, "
            "from sweeps of 5.5 % throttle; smaller sweeps stay in the linear range. "
            "Markers: slices as in the paper; lines: least squares over the phase of "
            "the whole sweep, with narrower intervals from the same recording.",
        ),
        (
            *_figure("throttle", "6", from_throttle, sliced(throttle), context.cutoff),
            *_figure("spark", "10", from_spark, sliced(spark), context.cutoff),
        ),
        describing_function_claims(from_throttle, from_spark, context.cutoff),
    )


def _sweeps(runs: list[Identification]) -> list[SweptRun]:
    made = [swept_run_of(run) for run in runs]
    return [run for run in made if isinstance(run, SweptRun)]


def _figure(
    actuator: str, number: str, found: Harmonics, slices: Harmonics, cutoff: float
) -> tuple[Drawn, ...]:
    if isinstance(found, NoHarmonics):
        return ()
    marks = slices if isinstance(slices, DescribingFunction) else None
    return drawn(
        f"describing_functions_{actuator}",
        f"Figure {number} of the paper: lines by least squares over the phase of "
        f"the excitation, with 95 % intervals; markers from slices.",
        lambda: describing_figure(found, marks, cutoff),
    )
