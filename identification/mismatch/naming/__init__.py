"""Selection of effects from the library that explain recordings, and their significance."""
