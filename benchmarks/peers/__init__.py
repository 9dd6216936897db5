"""The same joint by other codes."""
