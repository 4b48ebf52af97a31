//! Gates as a JUnit file: what CI servers agree on of it, test suites of test cases with failures.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::bail;
use dmp_draw::plot::escape;

use super::check::GateReport;

/// The whole file, of a suite of this name that took so many seconds.
pub(super) fn document(name: &str, total_s: f64, gates: &[GateReport]) -> String {
    let failures = gates.iter().filter(|gate| !gate.passed).count();
    let suite = escape(name);
    let head = format!(
        "tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"0\" time=\"{total_s:.3}\"",
        gates.len()
    );
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {head}>\n  <testsuite name=\"{suite}\" {head}>\n"
    );
    for gate in gates {
        let (run, reason) = (escape(&gate.run), escape(&gate.reason));
        let against = gate.against.as_ref().map_or(String::new(), |other| format!(" against {other}"));
        let name = escape(&format!("{}: {}{against}", gate.gate, gate.run));
        // Writing to a string cannot fail.
        let _ = write!(xml, "    <testcase classname=\"{run}\" name=\"{name}\" time=\"0\"");
        let _ = if gate.passed {
            writeln!(xml, "/>")
        } else {
            writeln!(xml, ">\n      <failure type=\"gate\" message=\"{reason}\"/>\n    </testcase>")
        };
    }
    xml + "  </testsuite>\n</testsuites>\n"
}

/// Refuses a JUnit file in a folder that is not there.
pub(super) fn check_folder(file: Option<&Path>) -> anyhow::Result<()> {
    let folder = file.and_then(Path::parent);
    if let Some(folder) = folder.filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
        bail!("{}: no such folder for --junit", folder.display());
    }
    Ok(())
}
