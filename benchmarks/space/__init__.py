"""Joints in space against other codes and closed forms."""
