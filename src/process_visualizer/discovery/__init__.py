"""A configuration made from what runs or was recorded; imports neither rospy nor Qt."""
