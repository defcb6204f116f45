"""A system beside its recordings: what its sensors would show, and where something may act."""
