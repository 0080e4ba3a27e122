"""Support data of images (ISDs of the Community Sensor Model), labels of ISIS cubes, as photos that move."""
