"""Shapes of yarns, loops and knits, and the optimisation of a loop (section 2.1 of the paper). No meshes."""

from knitstudy.geometry.lay_out import lay_out
from knitstudy.geometry.loop import Loop
from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.geometry.spline import CatmullRom, Centreline

__all__ = ["CatmullRom", "Centreline", "Crossings", "Knit", "Loop", "lay_out"]
