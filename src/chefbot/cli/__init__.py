"""The command line `chefbot GROUP VERB`: one package per group, whose `commands.py` declares its verbs."""
