"""The command ``cell``: what the window does with configurations and bags, without a window."""
