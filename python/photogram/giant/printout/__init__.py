"""The printout of GIANT (unit 6), in the order of the guide's sample."""
