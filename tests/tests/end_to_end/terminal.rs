//! Tables as terminals show them: how wide, in which colours, and what stays the same.

use std::path::Path;

use crate::common::{dmp, dmp_command, text};

const SAVED: &str = "score @/town.mcap -t @/truth.tum -t @/drift.tum -t @/noise.tum --json --quiet";

/// What `dmp compare` of a saved result prints with these options in an environment.
fn compared(folder: &Path, options: &str, environment: &[(&str, &str)]) -> String {
    let mut command = dmp_command(folder, &format!("compare a.json {options}"));
    let output = command.envs(environment.iter().copied()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn width_and_colour_are_asked_for_or_those_of_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("a.json"), dmp(path, SAVED).stdout).unwrap();
    let widest = |text: &str| text.lines().map(|line| line.chars().count()).max().unwrap();

    let piped = compared(path, "", &[]);
    assert!(piped.starts_with("truth is best: better than noise and drift.\n"), "{piped}");
    assert!(widest(&piped) <= 80 && !piped.contains('\u{1b}'), "{piped}");
    assert!(piped.contains("1 more pair, interval, "), "{piped}");
    for environment in [[("COLUMNS", "none")], [("COLUMNS", "80")], [("NO_COLOR", "1")], [("TERM", "xterm")]]
    {
        assert_eq!(compared(path, "", &environment), piped, "{environment:?}");
    }
    let wide = compared(path, "", &[("COLUMNS", "500")]);
    assert!((100..=140).contains(&widest(&wide)) && wide.contains("\n1 more pair: -v or --json\n"), "{wide}");
    let narrow = compared(path, "", &[("COLUMNS", "60")]);
    assert!(widest(&narrow) <= 60, "{narrow}");

    let coloured = compared(path, "--color always", &[("NO_COLOR", "1")]);
    assert!(coloured.starts_with("\u{1b}[1mtruth is best: "), "{coloured}");
    assert!(coloured.contains("\u{1b}[31mworse by "), "{coloured}");
    let mut plain = coloured;
    for tone in ["\u{1b}[0m", "\u{1b}[1m", "\u{1b}[31m", "\u{1b}[32m", "\u{1b}[33m"] {
        plain = plain.replace(tone, "");
    }
    assert_eq!(plain, piped);
    let forced = [("CLICOLOR_FORCE", "1")];
    assert_eq!(compared(path, "--color never", &forced), piped);
    assert_ne!(compared(path, "--color auto", &forced), piped);

    let json = compared(path, "--json", &[]);
    assert_eq!(compared(path, "--json --color always", &[("COLUMNS", "140")]), json);
    let verbose = compared(path, "-v", &[]);
    assert!(
        widest(&verbose) <= 80 && verbose.contains("\nnoise against drift: better, decided at"),
        "{verbose}"
    );
}
