"""python-can's own tests of a bus, of a log's writer and reader and of its player, on our bus.

Run by `make conformance` beside python-can's `test` package; not collected by `make test`.
"""

import sys
import uuid
from unittest import mock

import can
from test import back2back_test, logformats_test, test_player  # python-can's, not Python's

PATIENCE = 1.0  # s


class TestBackToBack(back2back_test.Back2BackTestCase):
    INTERFACE_1 = INTERFACE_2 = "slipbench"
    CHANNEL_1 = CHANNEL_2 = "back to back"


class TestThreadSafe(back2back_test.TestThreadSafeBus):
    INTERFACE_1 = INTERFACE_2 = "slipbench"
    CHANNEL_1 = CHANNEL_2 = "thread safe"


class ThroughTheBus(can.CanutilsLogWriter):
    """A log of what a listener hears of each message; the message's own time is kept."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        bus = {"interface": "slipbench", "channel": uuid.uuid4().hex, "fd": True}
        self._sender, self._listener = can.Bus(**bus), can.Bus(**bus)

    def on_message_received(self, msg):
        self._sender.send(msg)
        heard = self._listener.recv(PATIENCE)
        assert heard is not None, f"{msg} was not heard"
        heard.timestamp, heard.channel, heard.is_rx = msg.timestamp, msg.channel, msg.is_rx
        super().on_message_received(heard)

    def stop(self):
        self._sender.shutdown()
        self._listener.shutdown()
        super().stop()


class TestLogOfTheBus(logformats_test.TestCanutilsFileFormat):
    """ReaderWriterTest with the bus between the message and the log."""

    def _setup_instance(self):
        self._setup_instance_helper(
            ThroughTheBus,
            can.CanutilsLogReader,
            check_error_frames=False,  # no program can send one: controllers do
            check_fd=True,
            test_append=True,
            check_comments=False,
            preserves_channel=False,
        )


class OnSlipbench:
    """python-can's player with our bus in the place of its virtual one."""

    def setUp(self):
        self.MockVirtualBus = self._patched("slipbench.bench.bus.python_can.SlipbenchBus")
        self.mock_virtual_bus = self.MockVirtualBus.return_value
        self.mock_virtual_bus.__enter__ = mock.Mock(return_value=self.mock_virtual_bus)
        self.MockSleep = self._patched("can.io.player.time.sleep")
        self.baseargs = [sys.argv[0], "-i", "slipbench"]

    def _patched(self, what):
        patcher = mock.patch(what, spec=True)
        self.addCleanup(patcher.stop)
        return patcher.start()


class TestPlayer(OnSlipbench, test_player.TestPlayerScriptModule):
    pass


class TestPlayerOfCompressedFile(OnSlipbench, test_player.TestPlayerCompressedFile):
    pass
