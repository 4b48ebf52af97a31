//! Meshes: PLY and OBJ.
#![no_main]

use libfuzzer_sys::fuzz_target;

thread_local!(static FOLDER: dmp_fuzz::Folder = dmp_fuzz::Folder::default());

fuzz_target!(|bytes: &[u8]| {
    let name = if bytes.starts_with(b"ply") { "mesh.ply" } else { "mesh.obj" };
    FOLDER.with(|folder| dmp_fuzz::read_triangles(&folder.put(name, bytes)));
});
