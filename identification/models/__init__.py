"""Parametric models: rational with delay, switched, scheduled, and their uncertainty."""
