"""Quantities along edges and lines of runs."""
