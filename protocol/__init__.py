"""What two programs must agree on: frames on the bus and recordings on disk."""
