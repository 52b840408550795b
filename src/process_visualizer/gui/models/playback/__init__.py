"""Playback and what is in a recording."""
