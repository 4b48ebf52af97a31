//! Every row of the list of bad input has a test and stands in the documentation with it.

use crate::sources::{rust_files, workspace};

/// Rows of the list.
const ROWS: usize = 32;

/// Names of the tests in a folder.
fn tests(folder: &str) -> Vec<String> {
    let mut tests = Vec::new();
    for file in rust_files(&workspace().join(folder)) {
        let source = std::fs::read_to_string(file).unwrap();
        let mut is_test = false;
        for line in source.lines().map(str::trim) {
            if let Some(name) = line.strip_prefix("fn ").and_then(|rest| rest.split('(').next())
                && is_test
            {
                tests.push(name.to_owned());
            }
            is_test = line == "#[test]" || (is_test && line.starts_with("#["));
        }
    }
    tests
}

#[test]
fn every_row_has_a_test_and_the_documentation_names_them() {
    let all = tests("tests/tests/end_to_end");
    let here = tests("tests/tests/end_to_end/bad_input");
    let page = std::fs::read_to_string(workspace().join("docs/bad-input.md")).unwrap();
    for row in 1..=ROWS {
        let line = page.lines().find(|line| line.starts_with(&format!("| {row} |")));
        let line = line.unwrap_or_else(|| panic!("row {row} is not in docs/bad-input.md"));
        let start = format!("row_{row:02}_");
        let named: Vec<&str> = line.split('`').filter(|name| name.starts_with("row_")).collect();
        assert!(!named.is_empty(), "row {row} of docs/bad-input.md names no test");
        for name in &named {
            assert!(name.starts_with(&start) && all.iter().any(|test| test == name), "no test `{name}`");
        }
        for test in here.iter().filter(|test| test.starts_with(&start)) {
            assert!(named.contains(&test.as_str()), "row {row} of docs/bad-input.md does not name `{test}`");
        }
    }
}
