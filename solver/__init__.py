"""Scene file, bulk and contact terms, nonlinear solve, load stepping, results on disk."""
