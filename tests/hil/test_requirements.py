"""The device in C meets its requirements, and each planted fault is found by one of them."""

import re

import pytest

from tests.hil.device import CORE, SOURCES
from tests.hil.requirements import PLANTED, REQUIREMENTS
from tests.hil.tester import SimulatedDut, Tester


@pytest.mark.parametrize("name", REQUIREMENTS)
def test_the_device_meets_its_requirement(name: str, core) -> None:
    REQUIREMENTS[name](Tester(SimulatedDut(core(""))))


@pytest.mark.parametrize("planted", PLANTED)
def test_a_planted_fault_is_found(planted: str, core) -> None:
    failed = {name for name in REQUIREMENTS if not _met(name, core(planted))}
    print(f"{planted}: not met: {', '.join(sorted(failed))}")
    assert PLANTED[planted] in failed


def test_every_fault_that_can_be_planted_is_tried() -> None:
    text = "".join((SOURCES / name).read_text(encoding="utf-8") for name in (*CORE, "main.c"))
    assert set(re.findall(r"PLANTED_(\w+)", text)) == PLANTED.keys()


def test_every_requirement_finds_a_planted_fault() -> None:
    assert set(PLANTED.values()) == REQUIREMENTS.keys()


def _met(name: str, device) -> bool:
    try:
        REQUIREMENTS[name](Tester(SimulatedDut(device)))
    except AssertionError:
        return False
    return True
