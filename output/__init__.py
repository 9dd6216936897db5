"""What a run leaves on disk, and what it needs to go on."""
