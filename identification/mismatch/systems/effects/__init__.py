"""Effects that the equations of a model file may lack: one page per effect, for any seam."""
