"""Parameters with errors beyond their stated tolerance cause no wrong effect name."""

from tests.identification.mismatch.laws.explained import explained, large_errors, reported
from tests.identification.mismatch.laws.quick.test_numbers import BENT, known_to_factors
from tests.identification.mismatch.laws.spring import swung


def test_a_number_four_prior_deviations_off_takes_no_name(tmp_path):
    found = explained(known_to_factors(tmp_path, 18.0), [swung(1)], [swung(2)], BENT)
    assert not found.effects, reported(found)
    assert not large_errors(found) or found.unknown, reported(found)
