"""What RViz shows: camera, displays, the operator's saved views (pure)."""
