//! Where a linker asks for all symbols at once, it is told that an interpreter has those that are missing.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
