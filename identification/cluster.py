"""Many independent jobs at once, on dask.distributed: local processes, or a cluster that exists.

dask repeats the jobs of a worker that is lost. A job is a function of its arguments alone, so that
what comes out does not depend on who did it, or when.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import dask
from distributed import Client, LocalCluster, as_completed

from slipbench.protocol.errors import InputError

RETRIES = 3  # of a job whose worker was lost
PATIENCE = 20.0  # s, for a scheduler to answer
# Local processes keep the memory that they once had (glibc's mallopt(3), bytes). dask has it given
# back from 64 KiB on, and arrays of whole recordings then come back page by page: 6 million page
# faults instead of 0.12 in one sealed case, and 83 s instead of 69 side by side.
KEPT_MEMORY = {"MALLOC_TRIM_THRESHOLD_": 1 << 31, "MALLOC_MMAP_THRESHOLD_": 1 << 30}
Done = TypeVar("Done")


@dataclass(frozen=True)
class Workers:
    """Who does the work. count: local processes, one a processor if not told.

    scheduler: address of a cluster that exists ("tcp://host:8786"), instead of local processes.
    """

    count: int | None = None
    scheduler: str | None = None


ALL_PROCESSORS = Workers()


def done_by(
    workers: Workers, work: Callable[..., Done], jobs: Mapping[str, tuple[Any, ...]]
) -> Iterator[tuple[str, Done]]:
    """Yield name and result of every job as it is done; those named first are begun first.

    Raises what a job raises, and InputError where the scheduler does not answer.
    """
    with _client(workers) as client:
        futures = [
            client.submit(work, *arguments, key=name, retries=RETRIES, priority=-i, pure=False)
            for i, (name, arguments) in enumerate(jobs.items())
        ]
        for future in as_completed(futures):
            yield future.key, future.result()
            future.release()


@contextmanager
def _client(workers: Workers) -> Iterator[Client]:
    if workers.scheduler:
        try:
            client = Client(workers.scheduler, timeout=PATIENCE)
        except (OSError, ValueError) as fault:
            raise InputError(
                "the scheduler does not answer",
                where=workers.scheduler,
                found=str(fault),
                expected="the address of a dask scheduler",
                remedy="check --scheduler",
            ) from fault
        with client:
            yield client
        return
    with (
        dask.config.set(
            {f"distributed.nanny.pre-spawn-environ.{k}": v for k, v in KEPT_MEMORY.items()}
        ),
        LocalCluster(
            n_workers=workers.count,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
