//! Asks for those features of dependencies that the Python package needs and the command does not.
//!
//! Cargo builds a dependency anew for each set of features. As a default member beside the command, and below
//! `xtask`, this crate makes all sets equal, so that both are built on what was built for the command.
