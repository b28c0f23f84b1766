"""Isotropic elastic laws, one file each; a law is the function that its file registers."""

from knitstudy.mechanics.materials.material import LAWS, Material, law

__all__ = ["LAWS", "Material", "law"]
