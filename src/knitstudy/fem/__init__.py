"""Finite-element core: elements, materials, beams, constraints, Newton and linear solvers."""
