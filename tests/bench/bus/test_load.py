"""A bus under more load than a trial causes: no loss is unreported."""

import can

from tests.bench.bus.wires import Wire, carry, receive, send

BURST = 4_100  # frames: what 60 % of 1 Mbit/s carries in a second


def numbered(number: int, identifier: int = 0x100) -> can.Message:
    return can.Message(
        arbitration_id=identifier, data=number.to_bytes(8, "big"), is_extended_id=False
    )


def numbers(messages: list[can.Message]) -> list[int]:
    return [int.from_bytes(each.data, "big") for each in messages]


def test_a_second_of_the_fullest_bus_loses_nothing(wire: Wire) -> None:
    sender, listener = wire.node(False), wire.node(False)
    heard = carry(wire, sender, listener, [numbered(number) for number in range(BURST)])
    assert numbers(heard) == list(range(BURST))


def test_senders_at_the_same_time_do_not_disturb_each_other(wire: Wire) -> None:
    senders, listener = [wire.node(False) for _ in range(3)], wire.node(False)
    heard: list[can.Message] = []
    for first in range(0, 300, 50):
        for number in range(first, first + 50):
            for identifier, sender in enumerate(senders, start=0x200):
                send(sender, numbered(number, identifier))
        wire.settle()
        heard += receive(listener, 150)
    for identifier in range(0x200, 0x203):
        own = [each for each in heard if each.arbitration_id == identifier]
        assert numbers(own) == list(range(300))
