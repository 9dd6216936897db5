"""Shapes of joints, drawn and meshed by gmsh."""
