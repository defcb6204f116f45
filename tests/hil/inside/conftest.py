"""What needs a real vcan is collected only where there is one; tests/hil/on_vcan.py makes it."""

from tests.bench.bus.wires import VCAN

collect_ignore_glob = [] if VCAN else ["*"]
