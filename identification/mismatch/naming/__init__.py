"""With the library: which effects recordings ask for, and how certain they are."""
