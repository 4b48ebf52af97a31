//! The rows of docs/bad-input.md and the rows of the tests are the same.

use std::collections::BTreeSet;

use crate::sources::{rust_files, workspace};

/// Rows of the tests: entries `number: N` of tables of rows, and tests called `row_NN_...`.
fn tested() -> BTreeSet<usize> {
    let mut rows = BTreeSet::new();
    for file in rust_files(&workspace().join("tests/tests/end_to_end")) {
        let source = std::fs::read_to_string(&file).unwrap();
        let mut is_test = false;
        for line in source.lines().map(str::trim) {
            let row = line
                .strip_prefix("fn row_")
                .filter(|_| is_test)
                .and_then(|rest| rest.get(..2)?.parse::<usize>().ok());
            let entry = line.trim_start_matches("Row { ").strip_prefix("number: ");
            rows.extend(row.or(entry.and_then(|rest| rest.split(',').next()?.parse().ok())));
            is_test = line == "#[test]" || (is_test && line.starts_with("#["));
        }
    }
    rows
}

#[test]
fn every_row_has_a_test_and_stands_in_the_documentation() {
    let page = std::fs::read_to_string(workspace().join("docs/bad-input.md")).unwrap();
    let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.split(' ').next()?.parse().ok());
    let rows: BTreeSet<usize> = rows.collect();
    assert_eq!(rows, tested());
    assert_eq!(rows, (1..=rows.len()).collect(), "the rows are numbered");
}
