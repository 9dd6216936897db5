"""The sections of scenes: documented keys, checked."""
