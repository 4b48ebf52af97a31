//! What is wrong with how a page looks, in words; each check finds nothing on a sound page.

use super::Page;

impl Page<'_> {
    fn complaints(&self, check: &str) -> Vec<String> {
        let common = include_str!("layout/common.js");
        let found = self.evaluate(&format!("(() => {{ {common}\n{check} }})()"));
        serde_json::from_value(found).unwrap()
    }

    /// Everything that is wrong, each check's name before what it found.
    pub(crate) fn faults(&self) -> Vec<String> {
        let checks = [
            ("asks for", self.requests()),
            ("error", self.errors()),
            // What makes the page scroll sideways, what leaves the window without scrolling in a part of its own, and text that
            // its SVG picture cuts off.
            ("overflows", self.complaints(include_str!("layout/overflowing.js"))),
            // Pairs of texts, of HTML and of SVG, that cover each other by more than 2 px both ways.
            ("overlap", self.complaints(include_str!("layout/overlaps.js"))),
            // Sections, figures, tables, rows and pictures that hold nothing, or could not be drawn.
            ("empty", self.complaints(include_str!("layout/empty_boxes.js"))),
            // HTML text below the contrast that WCAG 2 asks for at level AA: 4.5, or 3 for large text.
            ("contrast", self.complaints(include_str!("layout/contrast.js"))),
        ];
        let named = |(name, found): (&str, Vec<String>)| {
            found.into_iter().map(|what| format!("{name}: {what}")).collect::<Vec<_>>()
        };
        checks.into_iter().flat_map(named).collect()
    }

    /// Fails with everything that is wrong.
    pub(crate) fn assert_sound(&self) {
        let faults = self.faults();
        assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    }
}
