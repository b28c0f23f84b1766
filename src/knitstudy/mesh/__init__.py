"""Solid meshes of yarns: section, sweep, quality gates, and files for other programs."""

from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import SweptMesh, sweep

__all__ = ["Section", "Spacing", "SweptMesh", "sweep"]
