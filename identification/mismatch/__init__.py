"""Localize, identify and model mismatch of simulation and recordings; validate it held out."""
