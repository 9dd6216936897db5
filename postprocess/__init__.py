"""Runs read, compared, drawn and exported; nothing here solves.

A run folder is a `run.Run`: its `curve` (P, p0 and eps over delta), the contact on its arcs (`arc`,
and `chord` for its projection) and its `fields`; a `sweep.Sweep` has many. `convergence` estimates
errors from several meshes, `comparison` sets runs against each other, `probe` follows an edge.
`tables` prints, `pictures` draw, `frames` gives pandas tables, `export` and `decks` write for other
programs.
"""
