"""Where studies live, and the studies of one problem."""
