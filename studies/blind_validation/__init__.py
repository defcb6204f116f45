"""The proof: sealed cases out of a generator of its own, analysed, unsealed and scored."""
