"""Solid elements, one file each; an element is the class that its file registers."""

from knitstudy.mechanics.elements import incompatible_modes, one_point  # noqa: F401
from knitstudy.mechanics.elements.element import Hexahedron, element, find, meanings, names

__all__ = ["Hexahedron", "element", "find", "meanings", "names"]
