"""Key figures at the top of a report."""

from dataclasses import dataclass

from slipbench.identification.models.delay_profile import DelayProfile
from slipbench.identification.models.study import Study
from slipbench.identification.report.key_figures import delays, main_delay
from slipbench.identification.report.words import (
    decibel,
    name,
    response_unit,
    time_in_words,
    time_unit,
)
from slipbench.identification.response.identify import Identification, slip_range
from slipbench.identification.response.resonance import Resonance
from slipbench.identification.response.response import least_coherence, reliable_band
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.codec.faults import Fault
from slipbench.protocol.recording.recording import Recording

KNOWN = 0.5
"""Half width of a 95 % interval, in its value, up to which a value is a headline."""


@dataclass(frozen=True)
class Tile:
    """One key figure: what it is, its value, and a note."""

    label: str
    value: str
    note: str


def tiles(found: Identification, study: Study) -> list[Tile]:
    """Key figures of a recording, in reading order; what is not known well is left out."""
    made: list[Tile] = []
    main, peak, span = found.main, found.resonance, slip_range(found)
    if main and isinstance(peak, Resonance):
        factor, unit = response_unit(main)
        low = f"DC gain {peak.low_gain * factor:.3g} {unit}"
        made.append(Tile("Resonance", f"{peak.frequency:.2f} Hz", low))
        made.append(Tile("Peak", f"{decibel(peak.peak):+.1f} dB", "above the DC gain"))
    if main:
        first, last = reliable_band(main) or (main.frequency[0], main.frequency[-1])
        band = f"minimum from {first:.2g} to {last:.3g}\u00a0Hz"
        made.append(Tile("Coherence", f"{least_coherence(main):.3f}", band))
    if span:
        where = "in the trial" if isinstance(found.window, TrialWindow) else "where defined"
        made.append(
            Tile(
                "Slip", f"{span[0] * 100:.2f} … {span[1] * 100:.2f} %", f"99 % of samples, {where}"
            )
        )
    return made + _model_tiles(study) + _delay_tiles(found) + _fault_tiles(found.recording)


def _model_tiles(study: Study) -> list[Tile]:
    """Dead time of the path behind the measured actuator, where there is one, else of all.

    No tile where the 95 % interval reaches 0 or is wider than the dead time itself: the tables
    give that interval.
    """
    known = [m for m in study.models if isinstance(m.delay, DelayProfile)]
    if not known:
        return []
    best = known[-1]
    assert isinstance(best.delay, DelayProfile)
    delay, low, high = best.delay.delay, best.delay.low, best.delay.high
    if not (low > 0.0 and 0.5 * (high - low) <= KNOWN * delay):
        return []
    factor, each = time_unit(delay)
    span = f"{factor * low:.1f} to {factor * high:.1f} {each}"
    note = f"from {name(best.response.input)}; 95 % interval {span}"
    return [Tile("Dead time", f"{factor * delay:.1f} {each}", note)]


def _delay_tiles(found: Identification) -> list[Tile]:
    known, made = delays(found), []
    if (key := main_delay(found)) in known:
        note = "phase slope at low frequency; includes servo, intake and driveline"
        path = "command to slip"
        if found.pair is not None:
            path, note = " to ".join(map(name, found.pair)), "phase slope at low frequency"
        made.append(Tile(f"Group delay, {path}", time_in_words(known[key]), note))
    if "encoder" in known:
        note = "mean age of the encoder speed; compensated in the analysis"
        made.append(Tile("Encoder delay", time_in_words(known["encoder"]), note))
    return made


def _fault_tiles(recording: Recording) -> list[Tile]:
    """Tile of the faulty frames; none for a recording without frames."""
    if not recording.frame_count:
        return []
    count = sum(f.count for f in recording.faults if f.fault != Fault.UNKNOWN)
    return [Tile("Faulty frames", f"{count}", f"of {recording.frame_count} frames")]
