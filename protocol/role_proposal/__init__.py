"""Propose a role map for a log that others recorded: which column has which role, in which unit."""
