"""Reference of every file that a user writes, made from the models that read it.

`python -m slipbench.reference FOLDER` writes the pages.
"""
