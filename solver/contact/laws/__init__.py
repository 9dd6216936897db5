"""Contact laws: the contact traction of a point from its gap, slip and trial traction."""
