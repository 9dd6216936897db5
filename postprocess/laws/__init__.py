"""P(delta) as formulas and fits: closed forms, calibration, the calibrated law."""
