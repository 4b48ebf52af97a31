//! Completions and manual pages, made from what `--help` is made from.

use std::process::Command;

use crate::common::{done, ends, has, misused, refused, text};

/// The long options that the help of a command names.
fn options_of(command: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let help = done(folder.path(), &format!("{command} --help"));
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
    let options: Vec<String> =
        ["score", "map build", "truth smd", "man"].iter().flat_map(|command| options_of(command)).collect();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = done(folder.path(), &format!("completions {shell}"));
        for option in &options {
            // fish names them without the dashes.
            let bare = format!("-l {}", option.trim_start_matches('-'));
            assert!(script.contains(option) || script.contains(&bare), "{shell}: {option}");
        }
    }
    misused(folder.path(), "completions cmd", &["possible values: bash, elvish, fish"]);
}

#[test]
#[cfg(unix)]
fn bash_completes_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let script = crate::common::write(folder.path(), "dmp.bash", &done(folder.path(), "completions bash"));
    for (words, expected) in
        [("dmp sc", "score"), ("dmp map ver", "verify"), ("dmp score --seg", "--segment")]
    {
        let all: Vec<&str> = words.split(' ').collect();
        let [.., before, last] = all[..] else { unreachable!() };
        let line = format!(
            "source {}; COMP_WORDS=({words}); COMP_CWORD={}; _dmp dmp {last} {before}; echo \"${{COMPREPLY[@]}}\"",
            script.display(),
            all.len() - 1,
        );
        let output = Command::new("bash").args(["--norc", "-c", &line]).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(text(&output.stdout).trim_end(), expected, "{words}");
    }
}

#[test]
fn manual_pages_have_every_option() {
    let folder = tempfile::tempdir().unwrap();
    ends(folder.path(), "man -o share/man1", 0);
    let page = |name: &str| std::fs::read_to_string(folder.path().join("share/man1").join(name)).unwrap();
    for command in ["score", "map build", "convert log", "truth ape", "simulate city"] {
        let name = format!("dmp-{}", command.replace(' ', "-"));
        let page = page(&format!("{name}.1"));
        let options: Vec<String> =
            options_of(command).iter().map(|option| option.replace('-', "\\-")).collect();
        has(&page, &options.iter().map(String::as_str).collect::<Vec<_>>());
        has(&page, &[&format!(".TH \"{name}\" 1 \"\" \"dmp "), ".SH EXAMPLES\n.nf\ndmp "]);
        assert_eq!(done(folder.path(), &format!("man {command}")), page, "{command}");
    }
    let root = page("dmp.1");
    assert_eq!(done(folder.path(), "man"), root);
    has(&root, &["dmp\\-score(1)", ".SH \"EXIT STATUS\""]);
    assert!(!folder.path().join("share/man1/dmp-help.1").exists());
    refused(folder.path(), "man nonsense", 2, &["`dmp` has no command `nonsense`; it has score, "]);
    refused(folder.path(), "man score more", 2, &["`dmp score` has no commands of its own", "`more`"]);
    crate::common::write(folder.path(), "file", "");
    refused(folder.path(), "man -o file", 1, &["file: cannot make the folder"]);
}
