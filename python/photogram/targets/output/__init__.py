"""Cameras and rigs as others take them: files of OpenCV, ROS, Kalibr and mrcal."""
