"""Maps and trajectories in memory: from what is asked, checked and planned once, to a data set."""
