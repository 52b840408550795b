"""Where xacro 2 finds packages of ROS 1: see xacro_child."""
