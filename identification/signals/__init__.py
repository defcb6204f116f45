"""Clocks, wheels, teeth, filters and slip: what a recording holds, made into signals."""
