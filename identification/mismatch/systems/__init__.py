"""Systems defined by a model file: states, inputs, outputs, parameters and seams, as text."""
