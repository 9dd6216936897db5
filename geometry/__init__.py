"""The joint as curved meshes: gmsh models, contact curves and their projections. Knows nothing of
forms."""
