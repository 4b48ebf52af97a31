//! Completions and manual pages, made from what `--help` is made from.

use std::process::Command;

use crate::common::{dmp, refused, text};

/// The long options that the help of a command names.
fn options_of(command: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let help = text(&dmp(folder.path(), &format!("{command} --help")).stdout);
    let option = |line: &str| {
        let words = line.trim_start();
        let long = words.find("--").filter(|&at| at == 0 || (at == 4 && words.starts_with('-')))?;
        let end = |c: char| !(c.is_ascii_lowercase() || "-_".contains(c));
        let option = &words[long..];
        Some(option[..option.find(end).unwrap_or(option.len())].to_owned())
    };
    let options: Vec<String> = help.lines().filter_map(option).collect();
    assert!(options.len() >= 3, "{help}");
    options
}

#[test]
fn completions_know_every_command_and_option() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = dmp(folder.path(), &format!("completions {shell}"));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let script = text(&output.stdout);
        for command in ["score", "map build", "truth smd", "man"] {
            for option in options_of(command) {
                // fish names them without the dashes.
                let bare = format!("-l {}", option.trim_start_matches('-'));
                assert!(script.contains(&option) || script.contains(&bare), "{shell}: {command} {option}");
            }
        }
    }
    let unknown = dmp(folder.path(), "completions cmd");
    assert_eq!(unknown.status.code(), Some(2));
    assert!(
        text(&unknown.stderr).contains("possible values: bash, elvish, fish"),
        "{}",
        text(&unknown.stderr)
    );
}

#[test]
#[cfg(unix)]
fn bash_completes_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("dmp.bash");
    std::fs::write(&script, dmp(folder.path(), "completions bash").stdout).unwrap();
    let completed = |words: &[&str]| {
        let line = format!(
            "source {}; COMP_WORDS=({}); COMP_CWORD={}; _dmp dmp {} {}; echo \"${{COMPREPLY[@]}}\"",
            script.display(),
            words.join(" "),
            words.len() - 1,
            words[words.len() - 1],
            words[words.len() - 2]
        );
        let output = Command::new("bash").args(["--norc", "-c", &line]).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout).trim_end().to_owned()
    };
    assert_eq!(completed(&["dmp", "sc"]), "score");
    assert_eq!(completed(&["dmp", "map", "ver"]), "verify");
    assert_eq!(completed(&["dmp", "score", "--free"]), "--free-space");
    assert_eq!(completed(&["dmp", "completions", "f"]), "fish");
}

#[test]
fn manual_pages_have_every_option() {
    let folder = tempfile::tempdir().unwrap();
    let output = dmp(folder.path(), "man -o share/man1");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).starts_with("share/man1: "), "{}", text(&output.stderr));
    let page = |name: &str| std::fs::read_to_string(folder.path().join("share/man1").join(name)).unwrap();
    for command in ["score", "map build", "convert log", "truth ape", "simulate city"] {
        let page = page(&format!("dmp-{}.1", command.replace(' ', "-")));
        let name = format!("dmp-{}", command.replace(' ', "-"));
        assert!(page.starts_with(&format!(".TH \"{name}\" 1 \"\" \"dmp ")), "{page}");
        for option in options_of(command) {
            assert!(page.contains(&option.replace('-', "\\-")), "{command} {option}");
        }
        assert!(page.contains(".SH EXAMPLES\n.nf\ndmp "), "{page}");
        assert_eq!(text(&dmp(folder.path(), &format!("man {command}")).stdout), page, "{command}");
    }
    let root = page("dmp.1");
    assert_eq!(text(&dmp(folder.path(), "man").stdout), root);
    assert!(root.contains("dmp\\-score(1)") && root.contains(".SH \"EXIT STATUS\""), "{root}");
    assert!(!folder.path().join("share/man1/dmp-help.1").exists());

    refused(folder.path(), "man nonsense", 2, &["`dmp` has no command `nonsense`; it has score, "]);
    refused(folder.path(), "man score more", 2, &["`dmp score` has no commands of its own", "`more`"]);
    std::fs::write(folder.path().join("file"), "").unwrap();
    refused(folder.path(), "man -o file", 1, &["file: cannot make the folder"]);
}
