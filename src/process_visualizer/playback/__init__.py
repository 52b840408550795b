"""The playback engine: timeline, scene, stamps, events (pure: no ROS node, no Qt)."""
