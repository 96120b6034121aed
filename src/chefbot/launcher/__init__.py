"""What `chefbot launch` does."""
