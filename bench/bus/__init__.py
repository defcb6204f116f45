"""Virtual CAN bus: a model of the wire, and interfaces of python-can to it.

`wire.py` is the model: frames and times are its input, deliveries its output; it has no clock and no
I/O. `simulated_bus.py` runs it on the simulated clock, `broker.py` in real time for several
processes. `python_can.py` is the python-can interface "slipbench", a client of the broker.
"""
