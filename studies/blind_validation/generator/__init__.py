"""Generator of recordings of motorcycles with hidden effects: equations, integrator and sensors of their own.

Nothing here comes from `plant` or from the rest of `identification`; import-linter checks it. What
the two share is the meaning of a vehicle file's numbers, and the database on the wire.
"""
