"""Location of a mismatch without the library: free curves at all injection points."""
