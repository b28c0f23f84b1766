"""Continuum and structural mechanics: elements, materials, contact laws, beams, Newton, linear solvers. No knits."""
