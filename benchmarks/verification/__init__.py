"""Our numbers against independent references."""
