"""Solid elements, one file each; an element is the class that its file registers."""

from knitstudy.mechanics.elements.element import ELEMENTS, Hexahedron, element

__all__ = ["ELEMENTS", "Hexahedron", "element"]
