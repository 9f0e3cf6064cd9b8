"""Meshes, panels, seams, meshing, stencils, adjacency; no physics."""
