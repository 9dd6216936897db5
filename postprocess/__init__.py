"""Reads results and turns them into quantities of the field; never solves."""
