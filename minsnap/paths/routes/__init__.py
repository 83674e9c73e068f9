"""Routes: maps read from files, ways through them, and plans whose distance to what is occupied is known."""
