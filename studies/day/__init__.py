"""A day at the track, rehearsed end to end on the simulated clock."""
