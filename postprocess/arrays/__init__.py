"""Fields and contact of a step of a run, as arrays and tables."""
