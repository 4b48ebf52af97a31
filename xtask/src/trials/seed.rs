//! What is attacked: a few small files that are well, and the commands that read them.

/// How a file is built, which tells how it is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// Nothing is known of it.
    Bytes,
    /// Words in lines.
    Text,
    Json,
    Mcap,
    /// rosbag2 in `SQLite`.
    Sqlite,
    /// A head in text, bytes behind it: PCD, PLY, npy.
    Headed,
    Las,
    Png,
    /// A map of our own.
    Store,
}

/// A file of a seed.
#[derive(Debug, Clone)]
pub(crate) struct File {
    /// Its place below the folder of a try, with `/`.
    pub(crate) path: String,
    pub(crate) bytes: Vec<u8>,
    /// How it is damaged; files without it are left as they are.
    pub(crate) form: Option<Form>,
}

/// A command that reads the files, run in their folder.
#[derive(Debug, Clone)]
pub(crate) struct Call {
    pub(crate) words: Vec<String>,
    /// Files and folders that it writes; all of them or none.
    pub(crate) outputs: Vec<String>,
    /// A command that must read what was written.
    pub(crate) then: Option<Vec<String>>,
}

impl Call {
    /// A command, told as in a shell without quotes. What follows `-o` is what it writes.
    pub(crate) fn new(line: &str) -> Self {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let output = words.iter().position(|word| word == "-o").and_then(|at| words.get(at + 1));
        Self { outputs: output.cloned().into_iter().collect(), words, then: None }
    }

    pub(crate) fn then(mut self, line: &str) -> Self {
        self.then = Some(line.split_whitespace().map(str::to_owned).collect());
        self
    }

    pub(crate) fn is_json(&self) -> bool {
        self.words.iter().any(|word| word == "--json")
    }

    /// Its name in the table: words and options without what is theirs alone.
    pub(crate) fn name(&self) -> String {
        let told = ["--json", "--quick", "--sample", "--map", "--like", "--made-with", "--between", "--log"];
        // Of some commands the second word is theirs too.
        let of_two = ["map", "convert", "truth", "simulate"];
        let words = self.words.iter().map(String::as_str);
        let own = 1 + usize::from(of_two.contains(&self.words[0].as_str()));
        let options = words.clone().skip(own).filter(|word| told.contains(word));
        let name: Vec<&str> = words.take(own).chain(options).collect();
        name.join(" ")
    }
}

/// Files that belong together, and what reads them.
#[derive(Debug, Clone)]
pub(crate) struct Seed {
    pub(crate) files: Vec<File>,
    pub(crate) calls: Vec<Call>,
    /// Checksums guard what the scores are made of: a byte that is wrong changes no score without a word.
    pub(crate) is_guarded: bool,
}

/// A seed of some files and commands, without checksums.
pub(crate) fn seed(files: Vec<File>, calls: &[&str]) -> Seed {
    let call = |line: &&str| match line.split_once(" => ") {
        Some((line, then)) => Call::new(line).then(then),
        None => Call::new(line),
    };
    Seed { files, calls: calls.iter().map(call).collect(), is_guarded: false }
}

/// A kind of input: a row of the table for each of its commands.
#[derive(Debug)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) seeds: Vec<Seed>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_called_by_what_they_do() {
        let call = Call::new("map build a.mcap -t a.tum -o out.dmpmap");
        assert_eq!(
            (call.name().as_str(), call.outputs.as_slice()),
            ("map build", &["out.dmpmap".to_owned()][..])
        );
        let call = Call::new("score a.mcap -t a.tum --map b.ply --json --quiet");
        assert_eq!(call.name(), "score --map --json");
        assert!(call.is_json() && call.outputs.is_empty());
    }
}
