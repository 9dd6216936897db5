"""Many scenes: designs solved side by side into one table, and the search for an accuracy."""
