//! Where a linker asks for all symbols at once, this lets those of an interpreter be missing.

fn main() {
    // Else whatever changes in the package's folder would build all of it again.
    println!("cargo::rerun-if-changed=build.rs");
    pyo3_build_config::add_extension_module_link_args();
}
