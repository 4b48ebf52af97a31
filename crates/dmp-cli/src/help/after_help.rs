//! What stands below the options of a command's help, in parts: pages of a manual set them in their own ways.

/// A part of the text below the options.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HelpPart<'a> {
    /// What it is about, such as `Examples`; empty where it does not say.
    pub title: &'a str,
    /// The rest.
    pub body: HelpBody<'a>,
}

/// What a part consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HelpBody<'a> {
    /// Lines to be typed, without their indent.
    Lines(Vec<&'a str>),
    /// Sentences.
    Text(&'a str),
}

/// Takes the text apart: parts are separated by an empty line. One that is a title with a colon and indented lines
/// holds lines to be typed; of any other a title may stand before the first colon.
pub fn help_parts(after_help: &str) -> Vec<HelpPart<'_>> {
    let part = |paragraph| {
        let (first, rest) = str::split_once(paragraph, '\n').unwrap_or((paragraph, ""));
        if let Some(title) = first.strip_suffix(':').filter(|_| rest.starts_with(' ')) {
            return HelpPart { title, body: HelpBody::Lines(rest.lines().map(str::trim_start).collect()) };
        }
        match paragraph.split_once(": ").filter(|(title, _)| title.split(' ').count() <= MOST_WORDS) {
            Some((title, text)) => HelpPart { title, body: HelpBody::Text(text) },
            None => HelpPart { title: "", body: HelpBody::Text(paragraph) },
        }
    };
    after_help.split("\n\n").map(|paragraph| paragraph.trim_matches('\n')).map(part).collect()
}

/// What stands before a colon and is longer than so many words is no title.
const MOST_WORDS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_are_not_sentences() {
        let parts = help_parts(
            "Examples:\n  dmp a\n    dmp b\n\nExit codes: 0 done; 1: no.\n\nIn one line or two: that",
        );
        let expected = [
            HelpPart { title: "Examples", body: HelpBody::Lines(vec!["dmp a", "dmp b"]) },
            HelpPart { title: "Exit codes", body: HelpBody::Text("0 done; 1: no.") },
            HelpPart { title: "", body: HelpBody::Text("In one line or two: that") },
        ];
        assert_eq!(parts, expected);
    }
}
