"""The hardware of a simulated robot at pseudo-terminals, for programs of a built robot."""
