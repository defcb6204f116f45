"""Closed loops rehearsed on the simulated motorcycle, sensors and delays included."""
