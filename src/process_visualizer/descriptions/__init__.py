"""Robot descriptions: xacro is expanded, urdfdom checks, extents and tool frames (pure)."""
