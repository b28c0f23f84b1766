"""Solid elements, one file each; an element is the class that its file registers."""

from knitstudy.mechanics.elements.element import ELEMENTS, ElementGroup, Elements, element

__all__ = ["ELEMENTS", "ElementGroup", "Elements", "element"]
