//! The decoder beside the crate `laz`, which has another one, and on damaged files.

mod ahead;
mod damage;
mod files;
mod oracle;
