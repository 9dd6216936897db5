"""The commands of the command line, and what is printed while they run."""
