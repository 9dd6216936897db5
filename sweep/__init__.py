"""Designs of many cases, solved side by side into one table."""
