"""The configuration: its language, model, parser, schema and errors (pure: no ROS node, no Qt)."""
