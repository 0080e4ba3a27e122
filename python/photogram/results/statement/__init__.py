"""What is said of the accuracy of an adjusted block, by standard, to whoever gets the product."""
