"""The printout of GIANT (unit 6): a module for each kind of page, in the order of the guide's sample."""
