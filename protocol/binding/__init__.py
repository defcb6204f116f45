"""Binding files: the location of each role of the bench on the bus of one motorcycle."""
