"""P(delta) as formulas and fits: closed forms, their calibration on runs, tables."""
