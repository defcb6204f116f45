"""A virtual CAN bus: a model of the wire, and what puts it under python-can.

`wire.py` is the model: frames and times go in, deliveries come out; it has no clock and does no
I/O. `simulated_bus.py` runs it on the simulated clock, `broker.py` in real time for several
processes, and `python_can.py` is the python-can interface "slipbench" at a broker.
"""
