"""`python -m chefbot`."""

from chefbot.cli import main

main()
