"""A season, a fleet: many analyses of one kind, side by side."""
