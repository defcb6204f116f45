"""FMUs that other tools made: read, simulated, explained."""
