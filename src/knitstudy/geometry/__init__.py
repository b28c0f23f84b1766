"""Yarn geometry: Catmull-Rom loops, their optimisation, and the knit that they make (section 2.1 of the
paper)."""

from knitstudy.geometry.build import build
from knitstudy.geometry.loop import Loop
from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.geometry.spline import CatmullRom, Centreline

__all__ = ["CatmullRom", "Centreline", "Crossings", "Knit", "Loop", "build"]
