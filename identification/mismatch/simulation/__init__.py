"""Simulation of a system with its sensors, for comparison with recordings; injection points."""
