"""The tasks of scenarios, one file a task: each runs it and raises TaskFailedError if it is not done."""
