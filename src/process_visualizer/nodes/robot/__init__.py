"""What the robot processor consists of."""
