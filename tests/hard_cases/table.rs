//! A table of hard cases, and its part of docs/hard-cases.md. The cases themselves are in the other modules.

#![allow(clippy::print_stdout, reason = "the table is what the test is for")]

use std::path::Path;

use crate::case::{Case, HEADING};

/// Cases under rows, in the order of the rows.
pub struct Table {
    heading: &'static str,
    rows: &'static [(&'static str, &'static str)],
    cases: Vec<Case>,
}

fn page() -> std::path::PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.ancestors().find(|folder| folder.join("Cargo.lock").exists());
    root.expect("the workspace has a lock file").join("docs/hard-cases.md")
}

/// Returns the page's parts, each of which begins with a line "# heading".
fn parts(page: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for line in page.lines() {
        if line.starts_with("# ") || parts.is_empty() {
            parts.push(String::new());
        }
        let part = parts.last_mut().expect("the first line begins a part");
        part.push_str(line);
        part.push('\n');
    }
    parts
}

fn shown(name: &str) -> String {
    name.replace('_', " ")
}

impl Table {
    /// Checks that every case belongs to a row and every row has a case.
    pub fn new(
        heading: &'static str,
        rows: &'static [(&'static str, &'static str)],
        mut cases: Vec<Case>,
    ) -> Self {
        let row = |case: &Case| {
            let found = rows.iter().position(|(row, _)| *row == case.row);
            found.unwrap_or_else(|| panic!("{} is in no row", case.name))
        };
        cases.sort_by_key(row);
        let has_case = |(row, _): &(&str, &str)| cases.iter().any(|case| case.row == *row);
        assert!(rows.iter().all(has_case), "a row without a case");
        Self { heading, rows, cases }
    }

    /// Runs all cases and prints them. With LUMBRE_WRITE_TABLES=1 they are also written to their part of the page.
    pub fn print(&self, command: &str, about: &str) {
        let mut text = format!(
            "# {}\n\n`LUMBRE_WRITE_TABLES=1 {command}` prints this part and writes it; each case is a test of its own too. {} cases{about}\n",
            self.heading,
            self.cases.len()
        );
        let mut failed = Vec::new();
        for (row, about) in self.rows {
            text += &format!("\n## {row}\n\n{about}\n\n{HEADING}\n");
            for case in self.cases.iter().filter(|case| case.row == *row) {
                let outcome = (case.run)();
                text += &format!("| {} | {outcome} |\n", shown(case.name));
                if !outcome.passes() {
                    failed.push(format!("{}: {outcome}", case.name));
                }
            }
        }
        println!("{text}");
        assert!(failed.is_empty(), "{failed:#?}");
        if std::env::var_os("LUMBRE_WRITE_TABLES").is_some() {
            let old = std::fs::read_to_string(page()).unwrap_or_default();
            let mut parts = parts(&old);
            // Parts are separated by an empty line.
            parts.iter_mut().for_each(|part| part.truncate(part.trim_end().len()));
            let first = format!("# {}", self.heading);
            match parts.iter_mut().find(|part| part.lines().next() == Some(&first)) {
                Some(part) => *part = text.trim_end().to_owned(),
                None => parts.push(text.trim_end().to_owned()),
            }
            std::fs::write(page(), parts.join("\n\n") + "\n").expect("the page can be written");
        }
    }

    /// Checks that the page has exactly these rows and cases.
    pub fn in_step(&self) {
        let page = std::fs::read_to_string(page()).expect("the page is there");
        let first = format!("# {}", self.heading);
        let parts = parts(&page);
        let part = parts.iter().find(|part| part.lines().next() == Some(&first));
        let mut found: Vec<(&str, Vec<&str>)> = Vec::new();
        for line in part.expect("the page has this part").lines() {
            if let Some(row) = line.strip_prefix("## ") {
                found.push((row, Vec::new()));
            } else if let Some(cells) = line.strip_prefix("| ")
                && let Some((_, cases)) = found.last_mut()
                && !line.starts_with("| case |")
            {
                cases.push(cells.split(" | ").next().unwrap_or_default());
            }
        }
        assert_eq!(found.len(), self.rows.len(), "rows of the page");
        for ((row, about), (listed, cases)) in self.rows.iter().zip(found) {
            assert_eq!(*row, listed);
            assert!(page.contains(about), "what is said about {row:?} is another thing; write the page anew");
            let own: Vec<String> =
                self.cases.iter().filter(|case| case.row == *row).map(|case| shown(case.name)).collect();
            assert_eq!(cases, own, "the cases of {row:?}; write the page anew with LUMBRE_WRITE_TABLES=1");
        }
    }
}
