"""Steps 1 and 2: what a toothed wheel can know, and the line that it draws (figures 1 and 2)."""

from slipbench.studies.paper import encoder_figures
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.encoder_study import encoder_claims
from slipbench.studies.paper.paper_section import Section, drawn
from slipbench.studies.paper.wheel_orders import order_claims


def encoder(context: Context) -> Section:
    """Tell error and delay of a toothed wheel against speed; nothing is recorded for that."""
    radius = context.nominal.rear_wheel.radius
    return Section(
        "1",
        "What the encoder can know",
        (
            "Between two teeth the wheel's speed is w = 2π / (N TT). More teeth are younger and "
            "less exact: the timer's microsecond weighs more in a shorter interval.",
        ),
        drawn(
            "encoder",
            "As the paper's figure 1: error bound and delay against speed; lines by the "
            "formula, markers measured on simulated teeth. Dashed: 10 ms and 40 km/h.",
            lambda: encoder_figures.encoder(radius),
        ),
        encoder_claims(radius),
    )


def wheel_lines(found: Found) -> Section:
    """Show the line of the wheel in the spectra."""
    one = runs_of(found, "throttle")[0]
    return Section(
        "2",
        "Spectra, and the line of the wheel",
        (
            "Rear wheel speed, suspension travel and engine speed of one throttle sweep. What "
            "repeats with every turn of the wheel draws lines at 1X, 2X, ...; one tooth out of "
            "place draws all of them, in the wheel's speed alone.",
        ),
        drawn(
            "wheel_orders",
            "As the paper's figure 2: amplitude spectra, wheel orders marked.",
            lambda: encoder_figures.orders(one),
        ),
        order_claims(one),
    )
