"""Nonparametric answers: spectra, frequency responses, harmonics."""
