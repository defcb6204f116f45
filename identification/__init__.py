"""Reads recordings, never a bus: signals, models and the report."""
