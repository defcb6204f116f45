"""Binary logs that are made to take all time or all memory are refused before they do."""

import struct
import zlib
from pathlib import Path
from time import process_time

import asammdf
import numpy as np
import pytest
from hypothesis import given, settings

from slipbench.protocol.errors import InputError
from slipbench.protocol.export import export_run
from slipbench.protocol.logs import blf_containers, mdf_chains, read_log
from slipbench.protocol.logs.mdf_chains import CHAINS_3, CHAINS_4, check_chains
from slipbench.protocol.tables import read_table
from tests.hostile.damage import damaged, fuzz, survives
from tests.protocol.export.test_export import run_of
from tests.protocol.export.test_export_portions import lines
from tests.recordings import recording

FRAMES = 60


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A small recording in every binary format that is read again."""
    run = run_of(tmp_path_factory.mktemp("exported") / "run", lines(FRAMES))
    done = {form: export_run(run, form).path for form in ("mf4", "blf", "parquet")}
    return {**done, "parquet": done["parquet"] / "frames.parquet"}


@pytest.fixture(scope="module")
def old(tmp_path_factory):
    """A file of MDF 3 with two groups of two channels."""
    path = tmp_path_factory.mktemp("old") / "old.mdf"
    with asammdf.MDF(version="3.30") as mdf:
        for group in range(2):
            times = np.arange(10) * 0.1
            mdf.append(
                [asammdf.Signal(times + k, times, name=f"channel_{group}_{k}") for k in range(2)]
            )
        return mdf.save(path)


def biting(data, mark, links, head, link):
    """Every file in which one link of a kind of block leads to the block itself."""
    at = data.index(mark)
    for number in links:
        bitten = bytearray(data)
        struct.pack_into(link, bitten, at + head + number * struct.calcsize(link), at)
        yield bytes(bitten)


@pytest.mark.parametrize("kind", ["DG", "CG", "CN", "FH"])
def test_a_chain_of_mdf_4_that_bites_its_own_tail_is_told(exported, tmp_path, kind):
    data, mark = exported["mf4"].read_bytes(), f"##{kind}".encode()
    chains = [n for n in CHAINS_4[mark] if n < 2]  # further ones are never of the block's own kind
    for bitten in biting(data, mark, chains, 24, "<Q"):
        (tmp_path / "x.mf4").write_bytes(bitten)
        began = process_time()
        for read in (read_log, read_table):
            with pytest.raises(InputError, match="go round in a circle"):
                read(tmp_path / "x.mf4")
        assert process_time() - began < 2.0


@pytest.mark.parametrize("kind", ["DG", "CG", "CN"])
def test_a_chain_of_mdf_3_that_bites_its_own_tail_is_told(old, tmp_path, kind):
    """A mark of two letters stands in other data too; with the size of its block it does not."""
    data, mark = old.read_bytes(), kind.encode()
    size = {"DG": 28, "CG": 30, "CN": 228}[kind]
    for bitten in biting(data, mark + struct.pack("<H", size), CHAINS_3[mark][:1], 4, "<I"):
        (tmp_path / "x.mdf").write_bytes(bitten)
        with pytest.raises(InputError, match="go round in a circle"):
            check_chains(tmp_path / "x.mdf")


def test_files_as_they_should_be_pass(exported, old):
    check_chains(exported["mf4"])
    check_chains(old)
    blf_containers.check_containers(exported["blf"])
    assert len(read_log(exported["mf4"]).frames) == FRAMES
    assert len(read_log(exported["blf"]).frames) == FRAMES


@pytest.mark.parametrize("name", ["obd2_logger.mf4", "ASAP2_Demo_V171.mf4"])
def test_files_of_real_loggers_pass(name):
    check_chains(recording(f"formats/{name}"))


def bomb(size):
    """A BLF file of one container of `size` zeros, packed."""
    packed = zlib.compress(bytes(size))
    container = struct.pack("<H6xL4x", 2, 1000) + packed
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 16 + len(container), 10)
    return struct.pack("<4sL", b"LOGG", 144) + bytes(136) + head + container


def test_a_container_that_would_fill_the_memory_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(blf_containers, "LARGEST", 1 << 20)
    (tmp_path / "x.blf").write_bytes(bomb(1 << 20))
    blf_containers.check_containers(tmp_path / "x.blf")
    (tmp_path / "x.blf").write_bytes(bomb((1 << 20) + 1))
    with pytest.raises(InputError, match="larger than a logger makes them"):
        read_log(tmp_path / "x.blf")


def packed_mdf(folder):
    """An MDF 4 file of packed blocks in a list, and where the first of them begins."""
    path = folder / "packed.mf4"
    with asammdf.MDF(version="4.10") as mdf:
        times = np.arange(60_000) * 0.001
        mdf.append([asammdf.Signal(np.zeros(60_000), times, name="nothing")])
        mdf.configure(write_fragment_size=100_000)
        mdf.save(path, compression=1)
    return path, path.read_bytes().index(b"##DZ")


def test_a_packed_block_of_mdf_that_would_fill_the_memory_is_told(tmp_path, monkeypatch):
    path, at = packed_mdf(tmp_path)
    check_chains(path)
    assert read_table(path)
    monkeypatch.setattr(mdf_chains, "LARGEST", 10_000)
    with pytest.raises(InputError, match="larger than a logger makes them"):
        read_table(path)
    monkeypatch.undo()
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, at + 32, 1 << 40)  # the size that it says it has unpacked
    path.write_bytes(data)
    with pytest.raises(InputError, match="larger than a logger makes them"):
        read_table(path)


def test_every_packed_block_of_a_list_is_looked_at(tmp_path, monkeypatch):
    path, _ = packed_mdf(tmp_path)
    looked = []
    monkeypatch.setattr(mdf_chains, "fits", lambda packed, _: looked.append(packed) or True)
    check_chains(path)
    assert len(looked) == path.read_bytes().count(b"##DZ") > 1


@pytest.mark.parametrize("size", [0, 15, 1 << 30])
def test_an_object_of_a_size_that_cannot_be_is_told(tmp_path, size):
    """python-can would read all that is left of the file, or for ever."""
    data = bytearray(bomb(1000))
    struct.pack_into("<L", data, 144 + 8, size)
    (tmp_path / "x.blf").write_bytes(data)
    with pytest.raises(InputError, match="larger than a logger makes them"):
        read_log(tmp_path / "x.blf")


@pytest.mark.parametrize(
    ("form", "read"), [("mf4", read_log), ("mf4", read_table), ("parquet", read_table)]
)
def test_a_damaged_file_is_read_or_told(exported, tmp_path, form, read):
    good: Path = exported[form]

    @settings(fuzz, max_examples=30)
    @given(damaged(good.read_bytes()))
    def attempt(data):
        survives(read, tmp_path / f"x{good.suffix}", data)

    attempt()
