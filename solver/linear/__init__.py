"""How a Newton system is solved."""
