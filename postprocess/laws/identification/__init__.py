"""Joints identified from measured curves: the curve as a file has it, the fit through the general
law, and what is said of it."""
