"""Static equilibrium at a given load: unknowns, forces, and the linear systems of Newton's method."""
