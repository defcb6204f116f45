"""Nonparametric estimates: spectra, frequency responses, harmonics."""
