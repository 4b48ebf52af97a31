//! Gates as a JUnit file: what CI servers agree on of it, test suites of test cases with failures.

use std::fmt::Write as _;

use dmp::Report;

use super::GateReport;

/// The whole file.
pub(super) fn document(report: &Report, gates: &[GateReport]) -> String {
    let failures = gates.iter().filter(|gate| !gate.passed).count();
    let suite = escaped(&format!("dmp {}", report.inputs.log));
    let head = format!(
        "tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"0\" time=\"{:.3}\"",
        gates.len(),
        report.timing.total_s
    );
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {head}>\n  <testsuite name=\"{suite}\" {head}>\n"
    );
    for gate in gates {
        let (run, reason) = (escaped(&gate.run), escaped(&gate.reason));
        let against = gate.against.as_ref().map_or(String::new(), |other| format!(" against {other}"));
        let name = escaped(&format!("{}: {}{against}", gate.gate, gate.run));
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

/// Text for XML 1.0, which has no control characters but line ends and tabs.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() || ('\u{fffe}'..='\u{ffff}').contains(&c) => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_does_not_allow_is_not_there() {
        assert_eq!(escaped("a<b> & \"c\"\u{1}\u{ffff}ü"), "a&lt;b&gt; &amp; &quot;c&quot;\u{fffd}\u{fffd}ü");
    }
}
