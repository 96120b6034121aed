"""Implementation of `chefbot launch`: sessions, worker processes, joining a robot."""
