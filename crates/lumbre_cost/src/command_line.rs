//! Quotes and splits the commands of a report as a POSIX shell does.

/// Returns a word of a shell command, quoted if necessary.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+:".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// Returns the words, without quotes, of each command in a line that joins commands by `&&`.
pub fn command_words(line: &str) -> Vec<Vec<String>> {
    let mut commands: Vec<Vec<String>> = vec![Vec::new()];
    let mut word: Option<String> = None;
    let mut is_quoted = false;
    let mut characters = line.chars();
    while let Some(c) = characters.next() {
        match c {
            '\'' => {
                is_quoted = !is_quoted;
                word.get_or_insert_default();
            }
            '\\' if !is_quoted => word.get_or_insert_default().extend(characters.next()),
            c if c.is_whitespace() && !is_quoted => end_word(&mut commands, word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    end_word(&mut commands, word);
    commands
}

fn end_word(commands: &mut Vec<Vec<String>>, word: Option<String>) {
    match (word, commands.last_mut()) {
        (Some(word), _) if word == "&&" => commands.push(Vec::new()),
        (Some(word), Some(last)) => last.push(word),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_spaces_are_one_word() {
        assert_eq!(quoted("/a/room-1.glb"), "/a/room-1.glb");
        assert_eq!(quoted("a room.glb"), "'a room.glb'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }

    #[test]
    fn what_is_quoted_is_read_again() {
        let words = ["lumbre", "render", "it's a room.glb", "", "a\\b", "--size", "8x8"];
        let line = words.map(quoted).join(" ");
        assert_eq!(command_words(&line), [words.map(str::to_owned).to_vec()]);
        let two = command_words("lumbre bake a.glb  -o b.glb && lumbre render b.glb");
        assert_eq!(two.iter().map(Vec::len).collect::<Vec<_>>(), [5, 3]);
    }
}
