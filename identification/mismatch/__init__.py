"""Where simulation and recording differ: located, named, modelled and proved on held-out data."""
