"""Shapes of yarns, loops and knits, and the optimisation of a loop (section 2.1 of the paper). No meshes."""
