"""Captions of the figures in a report."""

from slipbench.identification.report.words import name
from slipbench.identification.response.identify import Identification

COMMANDS = ("throttle_command", "spark_command")


def caption(figure: str, found: Identification) -> str:
    """Caption of a figure by its name, such as "overview" or "validation-0"."""
    return _overview(found) if figure == "overview" else CAPTIONS[figure.partition("-")[0]]


def _overview(found: Identification) -> str:
    """Text on the shaded range and on the input of the responses."""
    shaded = "excitation active" if found.selected is None else "selected window"
    if found.main is None:
        return f"Shaded: {shaded}."
    if found.main.input in COMMANDS:
        return (
            f"Shaded: {shaded}. The command is the value that the ECU reports as applied; it is the "
            "input of every frequency response below."
        )
    return f"Shaded: {shaded}. Input of the frequency response below: {name(found.main.input)}."


CAPTIONS = {
    "close_ups": "Details at three frequencies of the sweep.",
    "following": "Measured slip, computed after the trial, and the setpoint of the controller.",
    "response": (
        "First harmonic with 95 % interval. Faded: coherence below 0.8 or 95 % interval wider than half "
        "the gain. Dashed line: coherence limit."
    ),
    "servo": "Throttle servo: from throttle command to measured throttle position.",
    "model": (
        "Frequency response (independent bins) and fitted model, 95 % interval. The model curve includes "
        "the drift below the band."
    ),
    "harmonics": (
        "Second and third harmonic of slip relative to the first. Faded: 95 % interval wider than the "
        "value."
    ),
    "statistics": "Slip wherever it is defined; the colour of the right panel is the number of samples.",
    "spectra": (
        "Amplitude spectrum (amplitude of the sine at each frequency). Marked: orders of the driven "
        "wheel; 1X is one per revolution."
    ),
    "bus_load": "Bus load over time; dashed line: design limit of the database.",
    "lateness": "Histogram of the lateness of late ticks: actual minus scheduled start.",
    "nichols": "Points: reliable bins; lines: fitted models. The cursor gives the frequency.",
    "roots": (
        "Poles (x) and zeros (o) in Hz, with 95 % regions; those of real roots are intervals. A region "
        "wider than its root's frequency is not drawn. The dead time has no root."
    ),
    "step": (
        "Response of the fitted models to a unit step of the input, with 95 % band: parameters and "
        "order. What is slower than the band of the measurement is not part of the model."
    ),
    "validation": "Held-out data: the model's response to the measured input, and the residual.",
    "residual": (
        "Correlation over the lines of the band. Dashed: 95 % of the values are below, each by itself, "
        "where the residual is white (left) or independent of the input (right)."
    ),
}
