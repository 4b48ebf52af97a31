//! What must hold of the pages: links lead somewhere, the table of contents is whole, no guide is a book.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::Context as _;

use super::generated::GENERATED;
use super::markdown::Page;

/// Words that a page may have which is to be read from its beginning to its end.
const MOST_WORDS: usize = 2500;

/// Lines of the README, which is read by people who do not know yet whether they want this.
const MOST_LINES: usize = 150;

/// Pages to look something up in, and those that hold the tables that studies and benchmarks print.
const REFERENCE: [&str; 7] =
    ["accuracy", "architecture", "formats", "json", "metric", "performance", "reliability"];

/// Pages outside of `docs/` whose links are checked, too.
const BESIDE: [&str; 4] = ["README.md", "CONTRIBUTING.md", "deploy/README.md", "python/README.md"];

/// The table of contents, which is no page itself.
pub(super) const SUMMARY: &str = "docs/SUMMARY.md";

/// What is wrong, a line each; empty where all is well.
///
/// # Errors
/// Where a page cannot be read.
pub(super) fn problems(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut names: BTreeSet<PathBuf> = pages_below(root, Path::new("docs"))?;
    let docs = names.clone();
    names.extend(BESIDE.map(PathBuf::from));
    let mut found = Vec::new();
    let mut pages = BTreeMap::new();
    for name in names {
        let text = fs::read_to_string(root.join(&name))
            .with_context(|| format!("{}: cannot read", name.display()))?;
        let lines = text.lines().count();
        if name == Path::new("README.md") && lines > MOST_LINES {
            found.push(format!("{}: {lines} lines, more than {MOST_LINES}", name.display()));
        }
        pages.insert(name, Page::parse(&text));
    }
    for (name, page) in &pages {
        links(root, name, page, &pages, &mut found)?;
        let is_reference =
            REFERENCE.iter().any(|reference| *name == Path::new("docs").join(format!("{reference}.md")));
        if docs.contains(name) && !is_reference && page.words > MOST_WORDS {
            found.push(format!("{}: {} words, more than {MOST_WORDS}", name.display(), page.words));
        }
    }
    contents(&docs, &pages, &mut found);
    Ok(found)
}

/// All `.md` files of a folder and those below it, as seen from the root.
pub(super) fn pages_below(root: &Path, folder: &Path) -> anyhow::Result<BTreeSet<PathBuf>> {
    let mut pages = BTreeSet::new();
    let listed =
        fs::read_dir(root.join(folder)).with_context(|| format!("{}: cannot list", folder.display()))?;
    for entry in listed {
        let entry = entry.with_context(|| format!("{}: cannot list", folder.display()))?;
        let name = folder.join(entry.file_name());
        if entry.path().is_dir() {
            pages.extend(pages_below(root, &name)?);
        } else if name.extension().is_some_and(|extension| extension == "md") {
            pages.insert(name);
        }
    }
    Ok(pages)
}

/// Every link leads to a file of the repository, and what stands behind its `#` is a heading there.
fn links(
    root: &Path,
    name: &Path,
    page: &Page,
    pages: &BTreeMap<PathBuf, Page>,
    found: &mut Vec<String>,
) -> anyhow::Result<()> {
    for link in &page.links {
        let Some((file, anchor)) = target(name, &link.target) else { continue };
        let mut report =
            |what: &str| found.push(format!("{}:{}: {}: {what}", name.display(), link.line, link.target));
        let Some(file) = file else {
            report("leads out of the repository");
            continue;
        };
        if name == Path::new(SUMMARY) && is_generated(&file) {
            continue;
        }
        if !root.join(&file).exists() {
            report("no such file");
            continue;
        }
        let Some(anchor) = anchor else { continue };
        let known = match pages.get(&file) {
            Some(page) => page.anchors.contains(&anchor),
            None if file.extension().is_some_and(|extension| extension == "md") => {
                let text = fs::read_to_string(root.join(&file))
                    .with_context(|| format!("{}: cannot read", file.display()))?;
                Page::parse(&text).anchors.contains(&anchor)
            }
            None => false,
        };
        if !known {
            report("no such heading");
        }
    }
    Ok(())
}

fn is_generated(file: &Path) -> bool {
    GENERATED.iter().any(|name| file == Path::new(name))
}

/// The file that a link of a page leads to, as seen from the root, and what stands behind the `#`. Nothing for links to
/// other servers; no file where it leads out of the repository.
pub(super) fn target(page: &Path, link: &str) -> Option<(Option<PathBuf>, Option<String>)> {
    // A scheme comes before any slash: `https:`, `mailto:`.
    if link.split('/').next().is_some_and(|first| first.contains(':')) {
        return None;
    }
    let (path, anchor) =
        link.split_once('#').map_or((link, None), |(path, anchor)| (path, Some(anchor.to_owned())));
    if path.is_empty() {
        return Some((Some(page.to_owned()), anchor));
    }
    let mut file: PathBuf = page.parent().map(Path::to_owned).unwrap_or_default();
    for part in Path::new(path).components() {
        match part {
            Component::Normal(part) => file.push(part),
            Component::CurDir => {}
            Component::ParentDir if file.pop() => {}
            _ => return Some((None, anchor)),
        }
    }
    Some((Some(file), anchor))
}

/// The table of contents names every page once, and nothing else.
fn contents(docs: &BTreeSet<PathBuf>, pages: &BTreeMap<PathBuf, Page>, found: &mut Vec<String>) {
    let summary = Path::new(SUMMARY);
    let Some(listing) = pages.get(summary) else {
        found.push(format!("{SUMMARY}: is missing"));
        return;
    };
    let mut listed = BTreeSet::new();
    for link in &listing.links {
        let file = target(summary, &link.target).and_then(|(file, _)| file);
        let Some(file) = file.filter(|file| (docs.contains(file) && file != summary) || is_generated(file))
        else {
            found.push(format!("{SUMMARY}:{}: {}: no page of docs", link.line, link.target));
            continue;
        };
        if !listed.insert(file) {
            found.push(format!("{SUMMARY}:{}: {}: is there already", link.line, link.target));
        }
    }
    let missing = docs.iter().filter(|page| *page != summary && !listed.contains(*page));
    found.extend(missing.map(|page| format!("{}: is not in {SUMMARY}", page.display())));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A repository that is well, but for the files given.
    fn problems_with(files: &[(&str, &str)]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let well = [
            ("docs/SUMMARY.md", "# Summary\n\n- [A](a.md)\n- [B](guide/b.md)\n"),
            (
                "docs/a.md",
                "# A\n\n[b](guide/b.md#two-words), ![](figures/page.png), [web](https://a.b/c.md)\n",
            ),
            (
                "docs/guide/b.md",
                "# B\n\n## Two `words`\n\n[a](../a.md), [up](../../README.md#r), [here](#b)\n",
            ),
            ("docs/figures/page.png", ""),
            ("README.md", "# R\n\n[docs](docs), [a](docs/a.md#a)\n"),
        ];
        let empty = BESIDE.iter().map(|name| (*name, ""));
        for (name, text) in empty.chain(well).chain(files.iter().copied()) {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        problems(folder.path()).unwrap()
    }

    #[test]
    fn what_is_well_has_no_problems() {
        assert_eq!(problems_with(&[]), Vec::<String>::new());
    }

    #[test]
    fn broken_links_and_missing_anchors_are_named_with_their_lines() {
        let page = "# A\n\n[b](guide/c.md)\n[b](guide/b.md#three)\n[out](../../x.md)\n[root](/x.md)\n\
                    ![](figures/none.png)\n";
        assert_eq!(
            problems_with(&[
                ("docs/a.md", page),
                ("deploy/README.md", "[x](x.sh)"),
                ("README.md", "# R\n\n[d](#d)")
            ]),
            [
                "README.md:3: #d: no such heading",
                "deploy/README.md:1: x.sh: no such file",
                "docs/a.md:3: guide/c.md: no such file",
                "docs/a.md:4: guide/b.md#three: no such heading",
                "docs/a.md:5: ../../x.md: leads out of the repository",
                "docs/a.md:6: /x.md: leads out of the repository",
                "docs/a.md:7: figures/none.png: no such file",
            ]
        );
    }

    #[test]
    fn the_table_of_contents_and_the_pages_are_the_same() {
        let summary = "# Summary\n\n- [A](a.md)\n- [A](a.md)\n- [R](../README.md)\n- [C](cli.md)\n";
        let page = "# A\n\n[b](guide/b.md) [cli](cli.md)\n";
        assert_eq!(
            problems_with(&[("docs/SUMMARY.md", summary), ("docs/a.md", page)]),
            [
                "docs/a.md:3: cli.md: no such file",
                "docs/SUMMARY.md:4: a.md: is there already",
                "docs/SUMMARY.md:5: ../README.md: no page of docs",
                "docs/guide/b.md: is not in docs/SUMMARY.md",
            ]
        );
    }

    #[test]
    fn only_reference_pages_may_be_long() {
        let long = "# A\n\n".to_owned() + &"word ".repeat(MOST_WORDS);
        let summary = "- [A](a.md)\n- [B](guide/b.md)\n- [C](json.md)\n";
        let guide = "## Two words\n".to_owned() + &"word ".repeat(MOST_WORDS - 3);
        let files = [
            ("docs/SUMMARY.md", summary),
            ("docs/a.md", &long),
            ("docs/json.md", &long),
            ("docs/guide/b.md", &guide),
        ];
        assert_eq!(problems_with(&files), ["docs/a.md: 2502 words, more than 2500"]);
    }

    #[test]
    fn the_readme_stays_short() {
        let readme = "# R\n".to_owned() + &"word\n".repeat(MOST_LINES);
        assert_eq!(problems_with(&[("README.md", &readme)]), ["README.md: 151 lines, more than 150"]);
    }
}
