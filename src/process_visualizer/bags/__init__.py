"""Bags: index, timeline, stamps and playback (pure: no ROS node, no Qt)."""
