"""What published comparisons of wheel slip controllers vary and measure, and what ours has of it.

Sources are numbered as in SOURCES; each statement on one is from its abstract, nomenclature or scope.
"""

from dataclasses import dataclass

from slipbench.identification.closed_loop_simulation.markdown import table

SOURCES = (
    "D. Savitski et al., *Wheel Slip Control for the Electric Vehicle With In-Wheel Motors: Variable"
    " Structure and Sliding Mode Methods*, IEEE Trans. Industrial Electronics 67 (2020), 8535: a"
    " benchmark procedure by factors of driving safety, driving comfort and control quality; road"
    " tests at low friction.",
    "*Comparison of Traction Controllers for Electric Vehicles With On-Board Drivetrains*, IEEE Trans."
    " Vehicular Technology (2017): controllers compared with actuation dynamics and torsion of the"
    " half-shafts, in frequency and time domain.",
    "S. Li and T. Kawabe, *Slip Suppression of Electric Vehicles Using Sliding Mode Control Method*,"
    " Intelligent Control and Automation 4 (2013), doi 10.4236/ica.2013.43038: variations of mass and"
    " road.",
    "*Adaptive optimal slip ratio estimator for effective braking on a non-uniform condition road*,"
    " Automatika 60 (2019), 413, doi 10.1080/00051144.2019.1637053: initial speeds, non-uniform road.",
    "I. Petersen, T. A. Johansen, J. Kalkkuhl and J. Lüdemann, *Wheel Slip Control in ABS Brakes Using"
    " Gain Scheduled Constrained LQR*: gains by speed, robustness to the tyre's friction curve.",
    "M. Corno, G. Panzani and S. M. Savaresi, *Traction-Control-Oriented State Estimation for"
    " Motorcycles*, IEEE Trans. Control Systems Technology 21 (2013), 2400: noise of the estimated"
    " speed, wheelie detection.",
    "ISO 12364:2001, *Two-wheeled motorcycles - Antilock braking systems*: straight-line tests of"
    " adhesion utilization, wheel lock and ABS failure.",
    "F. Pretagostini et al., *Survey on Wheel Slip Control Design Strategies, Evaluation and Application"
    " to Antilock Braking Systems*, IEEE Access 8 (2020), 10951, doi 10.1109/ACCESS.2020.2965644.",
)
YES, PARTLY, NO = "yes", "partly", "no"


@dataclass(frozen=True)
class Factor:
    """text: what is varied or measured; sources: numbers; covered: yes, partly or no; here: how."""

    text: str
    sources: tuple[int, ...]
    covered: str
    here: str


VARIED = (
    Factor("low friction", (1, 3), YES, "wet road: half the grip; `tyre.friction` ±20 % and drawn"),
    Factor("friction that changes under way", (4,), YES, "wet patch: half the grip for 20 m"),
    Factor("friction curve of the tyre", (5,), YES, "`tyre.slip_stiffness` ±20 %, shape drawn"),
    Factor("mass", (3,), YES, "`body.mass` ±20 % and drawn"),
    Factor(
        "initial speed",
        (4, 5),
        PARTLY,
        "190 km/h, and a launch from 94 km/h; `design --schedule` for gains by speed",
    ),
    Factor(
        "dynamics and delay of the actuator",
        (2,),
        YES,
        "throttle servo ±20 %, delays drawn; effects: rate limit, stiction, air box",
    ),
    Factor(
        "torsion of the driveline", (2,), YES, "stiffness and damping ±20 %; backlash, cush drive"
    ),
    Factor("relaxation of the tyre", (2,), YES, "effect `relaxation_length`"),
    Factor(
        "noise and errors of the speed sensors",
        (6,),
        YES,
        "teeth in frames, tooth-pitch errors, noise of the optical sensor; seeds",
    ),
    Factor("wheel load", (), YES, "crest: half the rear load for 15 m; squat, load transfer"),
    Factor("slope, head wind", (), YES, "effects `grade` and `wind`"),
    Factor("wheelie", (6,), NO, "the plant has one rear load; the front wheel always rolls"),
    Factor("braking, failure of the system", (7,), NO, "drive slip only; faults: fault matrix"),
    Factor("lean angle, friction that differs from left to right", (), NO, "straight line only"),
)
MEASURED = (
    Factor("control quality", (1, 2), YES, "tracking bandwidth, overshoot, settling time, noise"),
    Factor("safety", (1,), YES, "peak slip; time lost to the best constant slip"),
    Factor("control effort", (2,), PARTLY, "mean spark retard; none of the throttle"),
    Factor(
        "margins in the frequency domain",
        (2,),
        YES,
        "gain and phase margin, sensitivity peak: `slipbench design --report`",
    ),
    Factor("comfort", (1,), NO, "no measure of jerk"),
)


def factors() -> str:
    """Section of the page."""
    varied, measured = (
        table((head, "in", "here", "how"), [_row(one) for one in rows])
        for head, rows in (("varied", VARIED), ("measured", MEASURED))
    )
    sources = "\n".join(f"{number}. {text}" for number, text in enumerate(SOURCES, 1))
    return (
        "## Factors of published benchmarks\n\nNo published benchmark is for motorcycles under drive"
        " slip; these compare wheel slip controllers of cars and motorcycles. *Drawn*: on"
        " [drawn motorcycles](controller_robustness.md).\n\n"
        f"{varied}\n\n{measured}\n\n{sources}"
    )


def _row(factor: Factor) -> tuple[str, ...]:
    sources = ", ".join(map(str, factor.sources)) or "-"
    return factor.text, sources, factor.covered, factor.here
