"""Several vehicles on one clock: how far apart they stay, proved, and plans that keep them apart."""
