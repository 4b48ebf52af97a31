//! What holds for the sources, the manifests and the documents themselves.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod architecture;
mod bad_input;
mod circles;
mod release;
mod rules;
mod sources;
