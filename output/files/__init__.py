"""Files that survive a kill and a full disk, and that tell of later changes."""
