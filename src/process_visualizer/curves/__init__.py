"""Process variables over a whole recording, and at a position of it (pure)."""
