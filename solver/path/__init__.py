"""A problem, assembled, and the path of its loads: Newton's method, load steps, guesses."""
