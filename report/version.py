"""The version that files and tables name."""

VERSION = "0.3.0"
