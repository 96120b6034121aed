"""`python -m chefbot`."""

from chefbot.cli.app import main

main()
