"""Studies of the product: the paper's findings, and blind validation of the mismatch engine."""
