"""Laws of identification."""
