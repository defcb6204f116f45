"""A trial from its file to its run folder: checks, excitation, live and simulated runs, outcome."""
