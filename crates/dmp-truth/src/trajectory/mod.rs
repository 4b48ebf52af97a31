//! Absolute and relative pose error of a trajectory against a reference.
