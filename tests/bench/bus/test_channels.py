"""Channels on the command line for the buses of a binding."""

from pathlib import Path

import pytest

from slipbench import dbc
from slipbench.bench.bus.channels import addresses_of, channels_of
from slipbench.protocol.binding.binding import Binding, own_binding
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from tests.protocol.binding.foreign import foreign_binding

OWN = own_binding(load_database(dbc.MOTORBIKE))
BUSES = ("powertrain", "chassis")


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Binding:
    return foreign_binding(1, tmp_path_factory.mktemp("two"), BUSES)


@pytest.mark.parametrize(
    ("texts", "channel"),
    [([], "can0"), (["vcan3"], "vcan3"), (["ws://host:54701/?a=b"], "ws://host:54701/?a=b")],
)
def test_one_channel_needs_no_name_where_there_is_one_bus(texts: list[str], channel: str) -> None:
    assert channels_of(texts, OWN) == (channel,)
    (address,) = addresses_of(texts, OWN, "socketcan", 500_000, False)
    assert (address.channel, address.bus, address.bitrate) == (channel, "", 500_000)


def test_each_bus_has_its_channel_in_whichever_order_they_are_named(two: Binding) -> None:
    texts = ["powertrain=can4", "chassis=can7"]
    for each in (texts, texts[::-1]):
        found = addresses_of(each, two, "pcan", 1_000_000, True)
        assert {a.name: a.channel for a in found} == {"powertrain": "can4", "chassis": "can7"}
        assert tuple(a.bus for a in found) == two.buses


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["powertrain=can0"], ["no --channel names the bus 'chassis'", "add --channel chassis="]),
        ([], ["no --channel names the bus", "found: none"]),
        (["can0"], ["names no bus", "BUS=CHANNEL", "as in --channel chassis=can0"]),
        (
            ["powertrain=can0", "chassis=can1", "body=can2"],
            ["no role of the binding lies on a bus 'body'", "chassis, powertrain"],
        ),
        (
            ["powertrain=can0", "powertrain=can1", "chassis=can2"],
            ["names the bus 'powertrain' twice"],
        ),
        (
            ["powertrain=can0", "chassis=can0"],
            ["'powertrain' and 'chassis' have the same channel", "found: can0"],
        ),
        (["powertrain=", "chassis=can1"], ["names no bus"]),
    ],
)
def test_channels_that_do_not_suit_the_buses_are_refused_with_the_remedy(
    two: Binding, texts: list[str], words: list[str]
) -> None:
    with pytest.raises(InputError) as refused:
        channels_of(texts, two)
    for each in (*words, "foreign.toml" if "same" not in words[0] else "--channel"):
        assert each in str(refused.value)


def test_the_messages_of_the_bus_without_a_channel_are_named(two: Binding) -> None:
    with pytest.raises(InputError) as refused:
        channels_of(["powertrain=can0"], two)
    assert two.messages_on("chassis")
    assert all(name in str(refused.value) for name in two.messages_on("chassis"))
    assert not any(name in str(refused.value) for name in two.messages_on("powertrain"))


@pytest.mark.parametrize("texts", [["powertrain=can0"], ["can0", "can1"]])
def test_a_binding_that_names_no_bus_takes_one_channel_without_a_name(texts: list[str]) -> None:
    with pytest.raises(InputError, match="the binding names no bus") as refused:
        channels_of(texts, OWN)
    assert Path(dbc.MOTORBIKE).name in str(refused.value)
