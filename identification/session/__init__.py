"""Several runs of one day: quick look after each, responses pooled over repeats, one report."""
