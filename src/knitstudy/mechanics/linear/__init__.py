"""Linear solvers behind one interface.

`lu` is direct; `conjugate` iterates with a preconditioner: `three_scale` (yarn, crossing, fabric) or `multigrid`.
"""
