"""`State` and the engines that step it."""
