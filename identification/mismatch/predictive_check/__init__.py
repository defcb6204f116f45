"""Posterior predictive check: repeat the analysis on recordings simulated from its result."""
