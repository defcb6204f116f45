"""Laws that cost less than five processor seconds each."""
