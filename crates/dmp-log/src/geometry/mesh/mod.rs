//! Triangle meshes given as a reference.

mod fans;
mod obj;
mod ply_mesh;
mod ply_rows;
mod read;

pub use fans::{MeshFormat, MeshSummary};
pub use read::{is_mesh, read_mesh};
