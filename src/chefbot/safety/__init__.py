"""What may limit or stop the wheels: pure, tested without a loop."""
