"""Contact of two surfaces by Nitsche's method."""
