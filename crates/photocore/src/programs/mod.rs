//! The photogrammetric models.
