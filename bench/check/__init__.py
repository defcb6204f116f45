"""`slipbench check`: every role of a binding on a real bus or in a capture, without sending a frame."""
