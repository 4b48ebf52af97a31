//! Distance of a map from a reference surface.
