"""Without the library: free curves at every place, and where something is missing."""
