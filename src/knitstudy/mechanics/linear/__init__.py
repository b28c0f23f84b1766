"""Linear solvers behind one interface.

`lu` is direct; `krylov` iterates with a preconditioner: `three_scale` (yarn, crossing, fabric) or `multigrid`;
`in_turn` iterates first and is direct where that fails.
"""
