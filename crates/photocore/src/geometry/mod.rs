//! Pure functions of photogrammetric geometry with their partial derivatives.
