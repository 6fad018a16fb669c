//! PETSc's options database: the user's values take precedence over those of the program.

use super::call::petsc;
use crate::error::{Error, Result};
use crate::files;
use std::collections::HashSet;
use std::ffi::{CString, c_char};
use std::path::Path;
use std::ptr::null_mut;

/// Options that PETSc reads before it counts their use, or only when it is finalized. They are
/// never reported as unused.
const READ_AT_THE_END: [&str; 19] = [
    "checkfunctionlist",
    "checkstack",
    "get_total_flops",
    "log",
    "log_all",
    "log_mpe",
    "log_summary",
    "log_trace",
    "log_view",
    "log_view_memory",
    "malloc_dump",
    "malloc_view",
    "memory_view",
    "mpidump",
    "no_signal_handler",
    "objects_dump",
    "options_left",
    "options_view",
    "skip_petscrc",
];

/// The options that the user gave on the command line or in `PETSC_OPTIONS`. PETSc ignores case.
#[derive(Debug, Default)]
pub(super) struct OptionsDatabase {
    given: HashSet<String>,
    /// Options given at the start, with their values, except those that only affect reports.
    text: String,
}

impl OptionsDatabase {
    /// Reads the database that PETSc filled from the user's input. This does not mark any option as
    /// used.
    pub(super) fn snapshot() -> Result<Self> {
        let mut text: *mut c_char = null_mut();
        petsc!(PetscOptionsGetAll(null_mut(), &mut text))?;
        // SAFETY: PETSc has allocated the string, which is freed below.
        let all = unsafe { super::call::string(text) };
        petsc!(contact_free(text.cast()))?;
        let given = all.split_whitespace().filter(|token| is_name(token)).map(key).collect();
        Ok(Self { given, text: that_compute(&all) })
    }

    /// Options given at the start, with their values, sorted. Options that PETSc reads only at its
    /// end are omitted.
    pub(super) fn at_the_start(&self) -> &str {
        &self.text
    }

    /// Marks an option as given by the user.
    pub(super) fn give(&mut self, name: &str) {
        self.given.insert(key(name));
    }

    /// Marks an option as not given by the user.
    pub(super) fn take_back(&mut self, name: &str) {
        self.given.remove(&key(name));
    }

    /// Whether the user gave this option; `name` with or without dash.
    pub(super) fn is_given(&self, name: &str) -> bool {
        self.given.contains(&key(name))
    }

    /// The user's options for the solver with this prefix, each as `-name`, sorted.
    pub(super) fn of_solver(&self, prefix: &str) -> Vec<String> {
        let kinds = ["ksp_", "pc_", "sub_", "mg_", "mat_"];
        let meant = |name: &&String| {
            name.strip_prefix(prefix).is_some_and(|rest| kinds.iter().any(|kind| rest.starts_with(kind)))
        };
        let mut names: Vec<String> = self.given.iter().filter(meant).map(|name| format!("-{name}")).collect();
        names.sort();
        names
    }

    /// The names of the user's options, sorted.
    pub(super) fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.given.iter().cloned().collect();
        names.sort();
        names
    }

    /// The user's options that this process has not read so far: name, and words as in `-name
    /// value`.
    pub(super) fn unused(&self) -> Result<Vec<(String, String)>> {
        let mut count = 0;
        let mut names = null_mut();
        let mut values = null_mut();
        petsc!(PetscOptionsLeftGet(null_mut(), &mut count, &mut names, &mut values))?;
        // SAFETY: PETSc returns `count` names and values, which are valid until they are returned
        // below.
        let pair = |i| unsafe { (super::call::string(*names.add(i)), super::call::string(*values.add(i))) };
        let left: Vec<(String, String)> = (0..count as usize).map(pair).collect();
        petsc!(PetscOptionsLeftRestore(null_mut(), &mut count, &mut names, &mut values))?;
        let counts = |name: &str| self.is_given(name) && !READ_AT_THE_END.contains(&key(name).as_str());
        let words = |(name, value): (String, String)| {
            let words = format!("-{} {value}", key(&name)).trim_end().to_owned();
            (key(&name), words)
        };
        Ok(left.into_iter().filter(|(name, _)| counts(name)).map(words).collect())
    }
}

/// The options in a text with their values, sorted, without those that PETSc reads only at its end.
fn that_compute(all: &str) -> String {
    let mut options: Vec<Vec<&str>> = Vec::new();
    for word in all.split_whitespace() {
        match options.last_mut().filter(|_| !is_name(word)) {
            Some(option) => option.push(word),
            None => options.push(vec![word]),
        }
    }
    options.retain(|option| !READ_AT_THE_END.contains(&key(option[0]).as_str()));
    let mut options: Vec<String> = options.iter().map(|option| option.join(" ")).collect();
    options.sort();
    options.join(" ")
}

/// Adds an option to the database; an empty value makes a flag.
pub(super) fn insert(name: &str, value: &str) -> Result<()> {
    let value = text(value)?;
    let pointer = if value.is_empty() { std::ptr::null() } else { value.as_ptr() };
    petsc!(PetscOptionsSetValue(null_mut(), dashed(name)?.as_ptr(), pointer))
}

/// Removes an option from the database.
pub(super) fn remove(name: &str) -> Result<()> {
    petsc!(PetscOptionsClearValue(null_mut(), dashed(name)?.as_ptr()))
}

/// Rejects stray words among the PETSc options, which PETSc would ignore silently.
///
/// # Errors
/// A usage error with the stray word.
pub fn validate(arguments: &[String]) -> Result<()> {
    let mut takes_value = false;
    for word in arguments {
        if !is_name(word) && !takes_value {
            let hint = "write PETSc options after `--`, each in the form `-name` or `-name value`";
            return Err(Error::usage(format!("`{word}` is not a PETSc option")).hint(hint));
        }
        takes_value = is_name(word);
    }
    Ok(())
}

/// Maximum size of an options file \[bytes\]: about ten thousand lines. Twice the value would do no
/// harm, and half of it would still suffice for every file that a person writes.
const LONGEST_FILE: u64 = 1 << 20;

/// Reads the options files that `words` name, and recursively those that these files name, as PETSc
/// will. PETSc would wait forever at a pipe, read a device without end, and follow a file that
/// names itself until the stack overflows.
///
/// # Errors
/// A file cannot be read, is not a regular file, names itself, or has a line that is not an option.
pub(super) fn require_files(words: &[&str]) -> Result<()> {
    follow(words, &mut Vec::new())
}

fn follow(words: &[&str], within: &mut Vec<String>) -> Result<()> {
    for (index, word) in words.iter().enumerate() {
        let is_yaml = match key(word).as_str() {
            "options_file" => false,
            "options_file_yaml" => true,
            _ => continue,
        };
        let Some(name) = words.get(index + 1).filter(|next| !next.starts_with('-')) else {
            let cure = format!("write the name of a file after it, for example `{word} options.txt`");
            return Err(Error::usage(format!("the PETSc option `{word}` has no file name")).hint(&cure));
        };
        let wrong = |what: String| {
            let cure = "an options file is a regular file with one option per line, such as `-ksp_rtol 1e-8`";
            Error::file(format!("{name}: {what}")).hint(cure)
        };
        if within.iter().any(|outer| outer == name) {
            return Err(wrong("the PETSc options file includes itself".into()));
        }
        let path = name.strip_suffix(":yaml").unwrap_or(name);
        let text = files::read(Path::new(path), LONGEST_FILE);
        let text = text.map_err(|error| wrong(format!("the PETSc options file can not be read: {error}")))?;
        let text = String::from_utf8_lossy(&text);
        let is_yaml = is_yaml
            || path != *name
            || [".yaml", ".yml", ".json"].iter().any(|ending| path.ends_with(ending))
            || ["%YAML ", "---"].iter().any(|mark| text.starts_with(mark));
        if is_yaml {
            continue;
        }
        let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
        let mut inner = Vec::new();
        for (number, line) in lines.enumerate() {
            let words: Vec<&str> = line.split_whitespace().collect();
            if !is_line(&words, line.contains(['"', '\''])) {
                let line = crate::error::shown(line.trim());
                return Err(wrong(format!("line {}: `{line}` is not a PETSc option", number + 1)));
            }
            inner.extend(words.into_iter().map(|word| word.trim_matches(['"', '\''])));
        }
        within.push((*name).to_owned());
        follow(&inner, within)?;
        within.pop();
    }
    Ok(())
}

/// Whether PETSc accepts these words as a line of an options file: nothing, an option with at most
/// one value, which may be several words in quotes, or `alias -new -old`.
fn is_line(words: &[&str], is_quoted: bool) -> bool {
    match words {
        [] => true,
        [alias, names @ ..] if alias.eq_ignore_ascii_case("alias") => {
            names.len() == 2 && names.iter().all(|name| is_name(name))
        }
        [name, values @ ..] => {
            is_name(name) && (is_quoted || values.len() <= 1 && !values.iter().any(|word| is_name(word)))
        }
    }
}

/// PETSc's rule for option names: one or two dashes, then a letter. `-1e-3` and `-inf` are values.
fn is_name(word: &str) -> bool {
    let Some(rest) = word.strip_prefix('-') else { return false };
    let rest = rest.strip_prefix('-').unwrap_or(rest);
    rest.starts_with(|first: char| first.is_ascii_alphabetic()) && word.parse::<f64>().is_err()
}

fn key(name: &str) -> String {
    name.trim_start_matches('-').to_ascii_lowercase()
}

fn dashed(name: &str) -> Result<CString> {
    text(&format!("-{}", name.trim_start_matches('-')))
}

/// Converts a string for C.
pub(super) fn text(words: &str) -> Result<CString> {
    CString::new(words).map_err(|_| Error::usage(format!("{words:?} contains a zero character")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An options file that PETSc can read is accepted. Any other file is rejected with its name
    /// and, if applicable, the line.
    #[test]
    fn files_of_options_are_read_before_petsc_reads_them() {
        let folder = std::env::temp_dir().join(format!("contact-petsc-{}-options", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = |name: &str| folder.join(name).display().to_string();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        let good = format!(
            "# all\n-ksp_rtol 1e-8 # tight\n\n  -log_view\nalias -a -b\n-t \"a b\"\n-options_file {}\n",
            path("in")
        );
        write("good", &good);
        write("in", "-ksp_type cg\n");
        write("any.yml", "- x: [\n");
        write("loop", &format!("-options_file {}\n", path("loop")));
        for (name, text) in
            [("word", "ksp_rtol 1"), ("two", "-a 1 2"), ("both", "\n-a -b"), ("alias", "alias -a")]
        {
            write(name, text);
        }
        assert!(std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
        for name in ["good", "any.yml"] {
            require_files(&["-a", "-options_file", &path(name), "-b"]).unwrap();
        }
        require_files(&[
            "-options_file_yaml",
            &path("word"),
            "-Options_File",
            &format!("{}:yaml", path("two")),
        ])
        .unwrap();
        for (name, words) in [
            ("word", "line 1: `ksp_rtol 1` is not"),
            ("two", "line 1: `-a 1 2` is not"),
            ("both", "line 2: `-a -b` is not"),
            ("alias", "line 1: `alias -a` is not"),
            ("loop", "includes itself"),
            ("absent", "No such file"),
            ("", "directory"),
            ("pipe", "a named pipe, not a regular file"),
        ] {
            let error = require_files(&["-options_file", &path(name)]).unwrap_err();
            assert!(error.exit_code() == 4 && error.message.contains(words), "{name}: {error}");
        }
        let error = require_files(&["-options_file", "-log_view"]).unwrap_err();
        assert!(error.exit_code() == 2 && error.message.contains("has no file name"), "{error}");
        assert!(require_files(&["-options_file", "/dev/zero"]).unwrap_err().message.contains("a device"));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    /// Stray words are rejected; values of any sign are accepted.
    #[test]
    fn tells_options_from_stray_words() {
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        for good in ["", "-ksp_monitor", "-ksp_rtol 1e-8 -log_view", "-a -1e-3 -b", "--ksp_view -x -inf"] {
            assert!(validate(&words(good)).is_ok(), "{good}");
        }
        for (bad, word) in [("ksp_monitor", "ksp_monitor"), ("-a 1 2 -b", "2"), ("-a - -b", "")] {
            match validate(&words(bad)) {
                Err(error) => assert!(error.message.contains(word) && error.exit_code() == 2, "{error}"),
                Ok(()) => assert!(word.is_empty(), "{bad}"),
            }
        }
    }
}
