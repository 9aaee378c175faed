"""One step of a lane, for any number of contacts: its memory, its types and what it records."""
