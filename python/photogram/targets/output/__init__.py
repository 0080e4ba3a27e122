"""Output of cameras and rigs: files of OpenCV, ROS, Kalibr and mrcal."""
