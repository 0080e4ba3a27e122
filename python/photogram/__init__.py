"""Photogrammetric least-squares adjustment with the covariance of every result."""
