"""Playback and its timeline."""
