"""Vectors and matrices of model files, as the numbers that they consist of."""
