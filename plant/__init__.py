"""The motorcycle as equations, and the library of effects that a simulation may have left out."""
