"""Control laws: pure functions of state, reference, measurement and step; no clock, no bus."""
