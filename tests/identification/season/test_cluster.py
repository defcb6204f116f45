"""Laws of reading on a dask cluster: the same index as here, and a fault for a folder it lacks."""

import os
import shutil

import pytest

from slipbench.identification.season import reading
from slipbench.identification.season.folders import INDEX
from slipbench.identification.season.index import refreshed
from slipbench.protocol.errors import InputError
from tests.identification.season.seasons import make_run, write

distributed = pytest.importorskip("distributed", reason="pip install 'slipbench[cluster]'")


@pytest.fixture(scope="module")
def scheduler():
    before = dict(os.environ)  # a nanny leaves its limits of memory in it
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
    ) as cluster:
        yield cluster.scheduler_address
    os.environ.clear()
    os.environ.update(before)


def test_a_cluster_reads_the_same(tmp_path, scheduler):
    for i in range(70):  # more than one job
        make_run(tmp_path / f"runs/a-{i}", 1 + i % 28, {"mileage": i}, 8.0 + i)
    write(tmp_path / "runs/a-3/run.toml", b"\xff")
    here = refreshed(tmp_path)
    shutil.rmtree(tmp_path / INDEX)
    assert refreshed(tmp_path, scheduler) == here
    assert sum(bool(one.fault) for one in here) == 1


def test_a_worker_without_the_folder_is_named(tmp_path):
    with pytest.raises(InputError, match="does not have this folder"):
        reading._read_part(str(tmp_path / "of another machine"), ())


def test_a_scheduler_that_does_not_answer_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("slipbench.identification.cluster.CONNECT_TIMEOUT", 0.2)
    make_run(tmp_path / "a")
    with pytest.raises(InputError, match="does not answer"):
        refreshed(tmp_path, "tcp://127.0.0.1:1")
