"""What a digit costs: error against run time, scaling, counts."""
