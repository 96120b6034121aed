"""`chefbot why`."""
