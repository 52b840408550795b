"""The only room of the window that knows rospy."""
