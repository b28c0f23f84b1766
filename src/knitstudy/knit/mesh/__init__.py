"""Solid meshes of yarns: sections, their sweep along centrelines, and gates on quality. No physics."""
