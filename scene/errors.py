"""What is said of bad input."""


class InputError(ValueError):
    """Bad input; the message holds one sentence a line."""
