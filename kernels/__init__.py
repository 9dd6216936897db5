"""Loops over points in C, where numpy would be most of a Newton iteration; compiled at first use,
like dolfinx's forms."""
