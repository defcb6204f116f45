"""Laws of the export of controllers to engine control units."""
