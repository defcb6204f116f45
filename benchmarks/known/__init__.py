"""Rides whose truth is known: which, what they gave, and the page of it."""
