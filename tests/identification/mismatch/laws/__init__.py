"""Laws of the explanation of a mismatch, at the level of its verdict; no engine is named in them."""
