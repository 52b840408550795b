"""What the window knows and can do: QObjects without widgets."""
