"""The command bag_player: options, keys and progress line in a terminal."""
