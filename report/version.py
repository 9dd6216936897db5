"""The version that files and tables name."""

VERSION = "0.1.0"
