"""The program ``gui``: the window, all models of it, and what connects them."""
