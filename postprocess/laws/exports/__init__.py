"""A joint's law as a file for other programs: Python, C, Modelica, Matlab/Octave, JavaScript,
JSON and FMU."""
