"""Periodic loop of the bench, its clock, its ring buffer and its recorder."""
