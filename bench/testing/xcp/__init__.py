"""XCP on CAN: measurements of an A2L file, read from an ECU by polling or by DAQ lists.

ASAM MCD-1 XCP 1.x, part 2 (protocol) and part 3 (CAN); ASAM MCD-2 MC 1.6 (A2L). `a2l.py` reads the
file, `packets.py` are the commands, `session.py` is the master on the bus of a test.
"""
