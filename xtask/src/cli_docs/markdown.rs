//! Sentences of `--help` as Markdown.

/// The sentences with their options in code, and what Markdown would take for its own escaped. What stands between
/// backticks is left as it is.
pub(super) fn sentences(help: &str) -> String {
    // Every second part stands between backticks; a last one without its end does not.
    let parts: Vec<&str> = help.split('`').collect();
    let text = parts.iter().enumerate().map(|(k, part)| match k % 2 {
        1 if k + 1 < parts.len() => format!("`{part}`"),
        1 => format!("\\`{}", plain(part)),
        _ => plain(part),
    });
    text.collect()
}

/// Words outside of code.
fn plain(text: &str) -> String {
    text.split_inclusive([' ', '\n']).map(word).collect()
}

/// An option in code; any other word with a backslash before what means something in Markdown.
fn word(word: &str) -> String {
    if let Some(at) = word.find("--").filter(|&at| word[..at].chars().all(|c| "([".contains(c))) {
        let (before, option) = word.split_at(at);
        let of_option = |c: char| c.is_ascii_alphanumeric() || "-_=,".contains(c);
        let end = option.find(|c| !of_option(c)).unwrap_or(option.len());
        let (option, after) = option.split_at(option[..end].trim_end_matches(',').len());
        if option.len() > 2 {
            return format!("{}`{option}`{}", escaped(before), escaped(after));
        }
    }
    escaped(word)
}

fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    let chars: Vec<char> = text.chars().collect();
    for (k, &c) in chars.iter().enumerate() {
        // Within a word an underscore is one.
        let inside = |at: Option<usize>| at.and_then(|at| chars.get(at)).is_some_and(|c| c.is_alphanumeric());
        let within = inside(k.checked_sub(1)) && inside(Some(k + 1));
        if matches!(c, '<' | '>' | '*' | '|' | '\\') || (c == '_' && !within) {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_stays_code_and_the_rest_is_escaped() {
        let cases = [
            ("`a_b <c>` and R_cv of *.tum", "`a_b <c>` and R_cv of \\*.tum"),
            ("with --made-with, (--decide=RUN,RUN): -t", "with `--made-with`, (`--decide=RUN,RUN`): -t"),
            ("a -- b <FILE> _x_ a|b", "a -- b \\<FILE\\> \\_x\\_ a\\|b"),
            ("one ` alone", "one \\` alone"),
            ("two\nlines --x\nmore", "two\nlines `--x`\nmore"),
        ];
        for (help, expected) in cases {
            assert_eq!(sentences(help), expected, "{help}");
        }
    }
}
