//! Nothing is built: this crate asks for features of what others build.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
