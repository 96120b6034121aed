"""The tasks of scenarios, one file per task: each runs it and raises TaskFailedError if it is not done."""
