"""Stream of a trial or a recording to Foxglove, Lichtblick and PlotJuggler."""
