//! What is wrong with how a page looks, in words; each check finds nothing on a sound page.

use super::Page;

impl Page<'_> {
    fn complaints(&self, check: &str) -> Vec<String> {
        let common = include_str!("layout/common.js");
        let found = self.evaluate(&format!("(() => {{ {common}\n{check} }})()"));
        serde_json::from_value(found).unwrap()
    }

    /// What makes the page scroll sideways, and what leaves the window without scrolling in a part of its own:
    /// elements, lines of text, and text that its SVG picture cuts off.
    pub(crate) fn overflowing(&self) -> Vec<String> {
        self.complaints(include_str!("layout/overflowing.js"))
    }

    /// Pairs of texts, of HTML and of SVG, that cover each other by more than 2 px both ways.
    pub(crate) fn overlaps(&self) -> Vec<String> {
        self.complaints(include_str!("layout/overlaps.js"))
    }

    /// Sections, figures, tables, rows and pictures that hold nothing, or could not be drawn.
    pub(crate) fn empty_boxes(&self) -> Vec<String> {
        self.complaints(include_str!("layout/empty_boxes.js"))
    }

    /// HTML text that is hard to tell from its background: below the contrast that WCAG 2 asks for at level
    /// AA, 4.5, or 3 for large text.
    pub(crate) fn contrast(&self) -> Vec<String> {
        self.complaints(include_str!("layout/contrast.js"))
    }

    /// Everything that is wrong, each check's name before what it found.
    pub(crate) fn faults(&self) -> Vec<String> {
        let checks = [
            ("asks for", self.requests()),
            ("error", self.errors()),
            ("overflows", self.overflowing()),
            ("overlap", self.overlaps()),
            ("empty", self.empty_boxes()),
            ("contrast", self.contrast()),
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
