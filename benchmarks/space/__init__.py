"""Joints in space against other codes and closed forms."""

import archord.kernels.compat  # noqa: F401  (before dolfinx)
