"""Controllers designed on identified models, with everything that the loop will add to them."""
