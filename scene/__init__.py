"""A problem in words: the sections of a scene, its file, and one sentence for every fault. Imports
no FE library."""
