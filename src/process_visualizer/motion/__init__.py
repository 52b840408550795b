"""Rotations, velocity estimation and arrows (pure: numpy only, no ROS node, no Qt)."""
