"""Runs judged: the margins of safety of a joint, and the errors that mesh and steps leave."""
