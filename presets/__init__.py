"""Scenes of known joints as problems to solve."""
