"""Load: a decode at 100 % in another process, for the duration of a `with` block."""

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def decoding() -> Iterator[None]:
    """Decode in a separate process until the block ends."""
    ready = multiprocessing.Event()
    process = multiprocessing.Process(target=_decode, args=(ready,), daemon=True)
    process.start()
    ready.wait(60)
    try:
        yield
    finally:
        process.terminate()
        process.join()


def _decode(ready: "multiprocessing.synchronize.Event") -> None:
    from decode import ours, traffic

    from slipbench.dbc import MOTORBIKE
    from slipbench.protocol.database.database import load_database

    database = load_database(MOTORBIKE)
    log = traffic(database, 200_000)
    ready.set()
    while True:
        ours(log, database)
