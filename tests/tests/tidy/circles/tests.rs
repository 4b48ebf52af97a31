//! The search for circles on small made-up crates.

use std::path::Path;

use super::Sources;
use super::graph::circles;
use super::resolve::imports;

/// The circles of a crate of these files, each named below `src`.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let sources: Sources =
        files.iter().map(|(name, text)| (Path::new("src").join(name), (*text).to_owned())).collect();
    circles(&imports(&sources))
}

fn assert_circle(files: &[(&str, &str)], lines: &[&str]) {
    let found = circles_of(files);
    assert_eq!(found.len(), 1, "{found:?}");
    let text = found[0].replace("src/", "");
    assert_eq!(text.lines().skip(1).map(str::trim).collect::<Vec<_>>(), lines);
}

#[test]
fn files_that_use_each_other_are_a_circle() {
    assert_circle(
        &[
            ("lib.rs", "mod a; mod b; mod apart;"),
            ("a.rs", "use crate::b::{self, B, C}; pub struct A(B, C);"),
            ("b.rs", "use std::fmt; use crate::{a::A as Other}; pub struct B; pub struct C;"),
            ("apart.rs", "use crate::{a::A, b::B};"),
        ],
        &["a.rs -> b.rs: B, C", "b.rs -> a.rs: A"],
    );
}

#[test]
fn a_circle_may_pass_through_many_files_and_there_may_be_several() {
    let found = circles_of(&[
        ("lib.rs", "mod a; mod b; mod c; mod d; mod e;"),
        ("a.rs", "use crate::b::B; pub struct A;"),
        ("b.rs", "use crate::c::C; pub struct B;"),
        ("c.rs", "use crate::a::A; use crate::d::D; pub struct C;"),
        ("d.rs", "use crate::e::E; pub struct D;"),
        ("e.rs", "use crate::d::D; pub struct E;"),
    ]);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].starts_with("3 files") && found[1].starts_with("2 files"), "{found:?}");
}

#[test]
fn super_leads_to_the_file_of_the_parent() {
    assert_circle(
        &[
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "mod child; pub struct Shared; fn f() { child::g(); }"),
            ("a/child.rs", "use super::Shared; pub fn g() {}"),
        ],
        &["a/child.rs -> a/mod.rs: Shared", "a/mod.rs -> a/child.rs: g"],
    );
    assert_circle(
        &[
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "pub(crate) mod child; pub struct Shared;"),
            ("a/child.rs", "fn f(_: super::super::b::B) {}"),
            (
                "b.rs",
                "use self::inner::B; mod inner { use crate::a::child; pub struct B; fn g() { child::f() } }",
            ),
        ],
        &["a/child.rs -> b.rs: B", "b.rs -> a/child.rs: f"],
    );
}

#[test]
fn a_re_export_leads_to_the_file_that_defines_the_name() {
    // `a` is a module, a function and a re-export of that function at once.
    assert_circle(
        &[
            ("lib.rs", "mod a; mod b; pub use a::a; pub use b::*;"),
            ("a.rs", "mod deep; pub use deep::Deep as Other; pub fn a() -> crate::B { crate::B::new() }"),
            ("a/deep.rs", "pub struct Deep; fn f() { crate::a() }"),
            ("b.rs", "use crate::a::Other; pub struct B;"),
        ],
        &["a/deep.rs -> a.rs: a", "a.rs -> b.rs: B", "b.rs -> a/deep.rs: Deep"],
    );
}

#[test]
fn paths_in_code_types_macros_and_attributes_count() {
    for user in [
        "fn f() { crate::a::g(1) }",
        "fn f(x: Vec<Option<crate::a::A>>) {}",
        "fn f() { println!(\"{}\", crate::a::g(1)) }",
        "use crate::a; fn f() { assert!(matches!(x, [a::A::Variant, ..]), \"no\") }",
        "#[derive(Serialize)] struct S { #[serde(with = \"crate::a::g\")] field: u8 }",
        "#[arg(value_parser = crate::a::g)] struct S;",
        "fn f() { use crate::a::A; }",
        "impl crate::a::A { fn f() {} }",
        "use crate::a::*; fn f() { g(1) }",
    ] {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "use crate::b; pub enum A { Variant } pub fn g(_: u8) { b::B; }"),
            ("b.rs", &format!("pub struct B; {user}")),
        ];
        assert_eq!(circles_of(&files).len(), 1, "{user}");
    }
}

#[test]
fn what_is_no_import_makes_no_circle() {
    for (lib, a, b) in [
        // A parent that declares and hands on, even where it defines something.
        (
            "mod a; mod b; pub use a::A; pub use b::B; pub struct Shared;",
            "use crate::{B, Shared};",
            "use super::Shared; pub struct B;",
        ),
        // Tests use what they like.
        (
            "mod a; mod b;",
            "use crate::b::B; pub struct A;",
            "pub struct B; #[cfg(test)] mod tests { use crate::a::A; }",
        ),
        ("mod a; mod b;", "use crate::b::B; pub struct A;", "#[cfg(test)] use crate::a::A; pub struct B;"),
        (
            "mod a; mod b;",
            "use crate::b::B; pub struct A;",
            "pub struct B; impl B { #[cfg(test)] fn f(_: crate::a::A) {} }",
        ),
        // Words and visibilities.
        (
            "mod a; mod b;",
            "use crate::b::B; pub struct A;",
            "//! As [`crate::a::A`].\npub(in crate::a) struct B;",
        ),
        // Other crates that are named like a file.
        (
            "mod a; mod b;",
            "use crate::b::B; pub struct A;",
            "use ::a::A; use other::a::A as Other; pub struct B;",
        ),
        // Names that are imported in a loop end nowhere.
        ("mod a; mod b;", "pub use crate::b::X;", "pub use crate::a::X;"),
    ] {
        let found = circles_of(&[("lib.rs", lib), ("a.rs", a), ("b.rs", b)]);
        assert!(found.is_empty(), "{b}: {found:?}");
    }
}
