"""What runs look like, as `pictures`: of a `joint`, and of `problems` in general."""
