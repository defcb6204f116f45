"""Numbers and effects fitted to recordings, with noise models; what a fit leaves."""
