"""What the equations of a model file may have left out: one page an effect, for any seam."""
