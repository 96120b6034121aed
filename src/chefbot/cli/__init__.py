"""The command line `chefbot GROUP VERB`: one package a group, whose `commands.py` declares its verbs."""
