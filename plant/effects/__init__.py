"""The library of effects: one page of physics a file."""
