"""The problem, bulk and contact terms, equilibrium, Newton's method, load stepping."""

import archord.kernels.compat  # noqa: F401  (before dolfinx)
