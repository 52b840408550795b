"""The report on a recording: what is in it and what is missing (pure)."""
