"""A shaft with recorded speed only and a once-per-turn disturbance outside the library."""

from slipbench.identification.mismatch.analysis import accepted, begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.improved import improved_system
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.recording import Recording
from tests.identification.mismatch.laws.drum import NOISE, drum, pulses, text_of, turned
from tests.identification.mismatch.laws.explained import reported


def test_pulses_are_told_as_a_curve_around_the_turn_and_not_found_again(tmp_path):
    """The initial angle of each training and held-out recording is unknown."""
    rides = [turned(seed, "tacho", pulses(60.0), drive=2.0) for seed in range(5)]
    first = analysed(drum(tmp_path, text_of("tacho")), rides)
    result = verdict(first)
    assert result.unknown, reported(result)
    assert result.curve is not None
    assert result.curve.regressor == "turn of angle"
    (error,) = result.held_out
    assert error.improved < 1.5 * NOISE["tacho"] < 0.1 * error.calibrated, reported(result)

    improved = drum(tmp_path, improved_system(accepted(first)).text())
    assert improved.file.curves[0].periodic
    again = verdict(analysed(improved, rides))
    assert not again.mismatch, reported(again)
    (error,) = again.held_out
    assert error.nominal < 1.5 * NOISE["tacho"], reported(again)


def analysed(system: ModelSystem, rides: list[Recording]):
    records = [system.prepare(r) for r in rides]
    few = [k for k in system.library if k.name in ("unbalance", "friction", "saturation")]
    return analyse(begin(system, records[:3], records[3:]), few)
