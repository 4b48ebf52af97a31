//! Asks for those features of dependencies that the Python package needs and the command does not.
//!
//! Cargo builds a dependency anew for each set of features. As a default member beside the command this crate makes both sets
//! equal, so that the package is built on what was built for the command.
