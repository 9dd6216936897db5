"""Static equilibrium at a given load: unknowns, forces, and linear systems."""
