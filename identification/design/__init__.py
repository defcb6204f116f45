"""Design of slip controllers on identified models, including the delays that the loop adds."""
