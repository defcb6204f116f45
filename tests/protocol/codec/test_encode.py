"""Whole columns are encoded as single messages are."""

import numpy as np
import pytest

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.encode import encode
from slipbench.protocol.codec.messages import (
    Authority,
    EcuStatus,
    EngineStatus,
    OpticalSpeed,
    ThrottleStatus,
)
from slipbench.protocol.database.database import load_database

DATABASE = load_database(dbc.MOTORBIKE)
CASES = [
    EcuStatus(Authority.SPARK, 0.1234, -0.07, 31.5),
    ThrottleStatus(Authority.THROTTLE, 0.5, -3.0, True, 0.25),
    EngineStatus(1466.0, 2, 0.6, 12.75),
    OpticalSpeed(53.21, True, 4.5),
]


@pytest.mark.parametrize("message", CASES, ids=[type(c).__name__ for c in CASES])
def test_columns_are_laid_out_as_the_codec_does(message) -> None:
    name, count = type(message).__name__, 40
    told = {field: getattr(message, field) for field in message.__slots__}
    columns = {
        field: np.full(count, int(value) if isinstance(value, (bool, int)) else value)
        for field, value in told.items()
    }
    codec = Codec(DATABASE)
    single = [codec.encode(message, counter=n % 15)[1] for n in range(count)]
    assert [bytes(row) for row in encode(DATABASE, name, columns)] == single


def test_a_value_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"OpticalSpeed\.speed"):
        encode(DATABASE, "OpticalSpeed", {"speed": np.array([50.0, 500.0]), "time": np.zeros(2)})
