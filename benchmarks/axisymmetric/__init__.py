"""Bodies of revolution against closed forms and other codes."""
