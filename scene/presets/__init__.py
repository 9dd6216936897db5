"""Presets: scenes in a few words, and the general scenes that they stand for."""
