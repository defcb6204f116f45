"""pytest plugin: the virtual motorcycle, the gateway, replay and stimulus as fixtures.

`plugin.py` is what pytest loads in every run. It imports pytest and the standard library only; all
else is imported by the first test that uses a fixture of it. `bench_bus.py` is the bus with its
clock, `stimulus.py` what a test does to it, `measurements.py` what a test measures.
"""
