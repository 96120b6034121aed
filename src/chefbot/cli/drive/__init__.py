"""Implementation of `chefbot drive`: teleoperation and commands for a running robot."""
