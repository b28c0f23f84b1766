"""Solid meshes of yarns: sections, their sweep along centrelines, and gates on quality. No physics."""

from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import SweptMesh, sweep

__all__ = ["Section", "Spacing", "SweptMesh", "sweep"]
