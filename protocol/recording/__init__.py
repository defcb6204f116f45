"""A recording on disk: run folder, role map, channels, tooth times."""
