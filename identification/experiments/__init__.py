"""Experiments that separate the hypotheses that recordings left open."""
