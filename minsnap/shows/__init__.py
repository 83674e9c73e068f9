"""Files of whole fleets, and shows: formations, the flights between them, lights, the report of what is certified."""
