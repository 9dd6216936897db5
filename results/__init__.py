"""Runs and sweeps on disk as objects, tables, pictures and files for other programs; never solves."""
