"""How two recordings of the same people lie to each other, in time and space, without a prior."""
