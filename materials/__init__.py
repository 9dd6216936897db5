"""Constitutive laws on arrays of points: strain in, stress and consistent tangent out. Knows
nothing of meshes."""
