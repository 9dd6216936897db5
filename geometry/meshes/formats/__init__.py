"""Meshes from files, from gmsh and from dolfinx."""

import archord.kernels.compat  # noqa: F401  (before dolfinx)
