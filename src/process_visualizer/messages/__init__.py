"""Messages as bytes: definitions, layout, stamps and parts, without deserialising (pure)."""
