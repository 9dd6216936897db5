"""Problems that others have set, with the values that they published."""
