"""Community Sensor Model: support data of images (ISDs of ALE) and labels of ISIS cubes as photos on trajectories."""
