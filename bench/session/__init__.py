"""A session at the track: planned trials one after another, resumed where it was interrupted."""
