"""Fits of parameters and effects to recordings, with noise models, and their residuals."""
