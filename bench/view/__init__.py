"""Live view of a trial in a browser or a terminal, fed from the files that the recorder writes."""
