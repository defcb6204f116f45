"""Laws that cost more than five processor seconds each."""
