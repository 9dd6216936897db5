"""Benchmarks: the paper's figures, error against run time, stability, scaling, peers."""
