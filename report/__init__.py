"""Tables, figures and files for people: one of each. Imports nothing of archord."""
