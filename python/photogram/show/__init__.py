"""What reports and pictures of all programs are made of."""
