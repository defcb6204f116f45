"""Run independent jobs in parallel on dask.distributed: local processes, or an existing cluster.

dask repeats the jobs of a worker that is lost. A job is a function of its arguments alone: its
result depends neither on the worker nor on the order of the jobs.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from distributed import Client

RETRIES = 3  # of a job whose worker was lost
CONNECT_TIMEOUT = 20.0  # s, for a scheduler to answer
# glibc's mallopt(3), bytes: freed memory stays with the process. dask returns it to the system from
# 64 KiB on, and arrays of whole recordings are then mapped again page by page: 6 million page
# faults instead of 0.12 million in one hidden case, 83 s instead of 69 s for two at a time.
KEPT_MEMORY = {"MALLOC_TRIM_THRESHOLD_": 1 << 31, "MALLOC_MMAP_THRESHOLD_": 1 << 30}
# A worker whose heartbeat is under way when the cluster closes logs a traceback. What a job raises is
# returned to its caller, and the loss of a worker is logged by the process that started it.
QUIET = {"DASK_LOGGING__DISTRIBUTED": "critical"}
ENVIRONMENT = KEPT_MEMORY | QUIET
Done = TypeVar("Done")


@dataclass(frozen=True)
class Workers:
    """Processes that run the jobs. count: local processes; None is one per processor.

    scheduler: address of an existing dask cluster ("tcp://host:8786"), instead of local processes.
    """

    count: int | None = None
    scheduler: str | None = None


ALL_PROCESSORS = Workers()


def done_by(
    workers: Workers, work: Callable[..., Done], jobs: Mapping[str, tuple[Any, ...]]
) -> Iterator[tuple[str, Done]]:
    """Yield name and result of every job as it is completed; the first jobs are started first.

    Raises what a job raises, and InputError where dask is not installed or the scheduler does not
    answer.
    """
    distributed = optional_library("distributed")
    with _client(workers) as client:
        futures = [
            client.submit(work, *arguments, key=name, retries=RETRIES, priority=-i, pure=False)
            for i, (name, arguments) in enumerate(jobs.items())
        ]
        for future in distributed.as_completed(futures):
            yield future.key, future.result()
            future.release()


@contextmanager
def _client(workers: Workers) -> Iterator["Client"]:
    dask, distributed = optional_library("dask"), optional_library("distributed")
    if workers.scheduler:
        try:
            client = distributed.Client(workers.scheduler, timeout=CONNECT_TIMEOUT)
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
            {f"distributed.nanny.pre-spawn-environ.{k}": v for k, v in ENVIRONMENT.items()}
        ),
        distributed.LocalCluster(
            n_workers=workers.count,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client
