"""What `chefbot VERB` does, one file a verb."""
