"""Meshes as arrays and on ranks, with named sets."""

import archord.kernels.compat  # noqa: F401  (before dolfinx)
