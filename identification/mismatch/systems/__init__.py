"""Systems that a model file tells: states, inputs, outputs, parameters and seams, as text."""
