"""Where people are, for the nodes that drive among them."""
