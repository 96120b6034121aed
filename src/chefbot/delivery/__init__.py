"""What a waiter does with orders."""
