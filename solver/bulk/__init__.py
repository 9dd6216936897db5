"""The bodies between their contacts: internal forces, tangents, and what they recover."""
