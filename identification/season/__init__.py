"""An index of sessions, runs and analyses below a folder: filter, compare, trends over a season."""
