"""Binding files: where each role of the bench lives on the bus of one motorcycle."""
