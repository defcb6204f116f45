"""Everything that touches time and hardware: clock, loop, gateway, trial, safety, recorder."""
