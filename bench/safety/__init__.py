"""The safety gate: vehicle monitor, trial state machine, and the permit that has the last word."""
