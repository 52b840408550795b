"""What the operator sees: widgets that show a model and call its methods."""
