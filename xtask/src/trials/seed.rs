//! Files that belong together, and commands that read them.

use super::Form;

/// A file of a try.
#[derive(Debug, Clone)]
pub(crate) struct File {
    /// Its place below the folder of a try, with `/`.
    pub(crate) path: String,
    pub(crate) bytes: Vec<u8>,
    /// How it is damaged; files without it stay as they are.
    pub(crate) form: Option<Form>,
}

/// A command that reads the files, run in their folder.
#[derive(Debug, Clone)]
pub(crate) struct Call {
    pub(crate) words: Vec<String>,
    /// What it writes; all of it or nothing.
    pub(crate) output: Option<String>,
    /// A command that must read the output.
    pub(crate) then: Option<Vec<String>>,
}

impl Call {
    /// A command, as in a shell without quotes. Behind ` => ` is a command that must read its output, or, after `writes`, an
    /// output that no `-o` names.
    pub(crate) fn new(line: &str) -> Self {
        let (line, behind) = line.split_once(" => ").map_or((line, None), |(line, then)| (line, Some(then)));
        let split = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let words = split(line);
        let named = words.iter().position(|word| word == "-o").and_then(|at| words.get(at + 1)).cloned();
        let written = behind.and_then(|behind| behind.strip_prefix("writes "));
        let then = behind.filter(|_| written.is_none()).map(split);
        Self { output: written.map(str::to_owned).or(named), words, then }
    }

    pub(crate) fn is_json(&self) -> bool {
        self.words.iter().any(|word| word == "--json")
    }

    /// Its name in the table: words and options without what is theirs alone.
    pub(crate) fn name(&self) -> String {
        let named = ["--json", "--quick", "--map", "--like", "--made-with", "--between", "--log"];
        // Of some commands the second word is theirs too.
        let of_two = ["map", "convert", "truth", "simulate"];
        let own = 1 + usize::from(of_two.contains(&self.words[0].as_str()));
        let words = self.words.iter().map(String::as_str);
        let options = words.clone().skip(own).filter(|word| named.contains(word));
        let name: Vec<&str> = words.take(own).chain(options).collect();
        name.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_called_by_what_they_do() {
        let call = Call::new("map build a.mcap -t a.tum -o out.dmpmap => map verify out.dmpmap");
        assert_eq!((call.name().as_str(), call.output.as_deref()), ("map build", Some("out.dmpmap")));
        assert_eq!(call.then.unwrap().len(), 3);
        let call = Call::new("score a.mcap -t a.tum --map b.ply --json => writes out.ply");
        assert_eq!(call.name(), "score --map --json");
        assert!(call.is_json() && call.then.is_none() && call.output.as_deref() == Some("out.ply"));
    }
}
