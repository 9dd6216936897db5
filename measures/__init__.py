"""What is measured of every accepted step, and what its user is warned of."""
