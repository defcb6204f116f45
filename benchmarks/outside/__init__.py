"""Published benchmarks by their own splits and figures of merit, beside what others reached."""
