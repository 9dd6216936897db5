"""Meshes as arrays and on ranks, with named sets."""
