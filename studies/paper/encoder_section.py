"""Steps 1 and 2: error and delay of a toothed-wheel encoder, and its 1X order (figures 1 and 2)."""

from slipbench.studies.paper import encoder_figures
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.encoder_study import encoder_claims
from slipbench.studies.paper.paper_section import Section, drawn
from slipbench.studies.paper.wheel_orders import order_claims


def encoder(context: Context) -> Section:
    """Section on error and delay of an encoder over speed; it needs no recording."""
    radius = context.nominal.rear_wheel.radius
    return Section(
        "1",
        "Resolution and delay of the encoder",
        (
            "Between two teeth the wheel's speed is w = 2π / (N TT). More teeth give a smaller delay and a larger error, because the timer "
            "resolution of 1 µs is a larger share of a shorter interval.",
        ),
        drawn(
            "encoder",
            "Figure 1 of the paper: error bound and delay over speed; lines: formula, "
            "markers: simulated teeth. Dashed: 10 ms and 40 km/h.",
            lambda: encoder_figures.encoder(radius),
        ),
        encoder_claims(radius),
    )


def wheel_lines(found: Found) -> Section:
    """Section on the 1X order of the wheel in the spectra."""
    one = runs_of(found, "throttle")[0]
    return Section(
        "2",
        "Spectra and wheel orders",
        (
            "Rear wheel speed, suspension travel and engine speed of one throttle sweep. Periodic errors of the wheel appear at the orders 1X, 2X, ...; one "
            "displaced tooth causes all of them, in the wheel speed only.",
        ),
        drawn(
            "wheel_orders",
            "Figure 2 of the paper: amplitude spectra, wheel orders marked.",
            lambda: encoder_figures.orders(one),
        ),
        order_claims(one),
    )
