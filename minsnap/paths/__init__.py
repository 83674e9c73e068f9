"""Where paths come from: shapes, maps with ways through them, courses and missions."""
