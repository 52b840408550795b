"""The services of player, recorder, RViz and ROS as methods, for window and commands (rospy)."""
