//! Warnings for people: of many that differ only in the object and its numbers, the first few and a count. The JSON
//! report lists all those of the bake.

/// Warnings of one kind that are shown.
const SHOWN: usize = 3;

/// The warnings in order of the first of each kind; where there are many of a kind, a line counts those left out.
pub fn shortened(warnings: impl Iterator<Item = String>) -> Vec<String> {
    let mut kinds: Vec<(String, Vec<String>)> = Vec::new();
    for warning in warnings {
        let kind = kind(&warning);
        match kinds.iter_mut().find(|(other, _)| *other == kind) {
            Some((_, alike)) => alike.push(warning),
            None => kinds.push((kind, vec![warning])),
        }
    }
    let shown = |(_, mut alike): (String, Vec<String>)| {
        // One line left out would take a line to count.
        if alike.len() > SHOWN + 1 {
            let more = alike.len() - SHOWN;
            alike.truncate(SHOWN);
            alike.push(format!("{more} more warnings like these (--json lists those of the bake)"));
        }
        alike
    };
    kinds.into_iter().flat_map(shown).collect()
}

/// What a warning says, without the object that it is about, and without digits, signs and points of numbers.
fn kind(warning: &str) -> String {
    let (_, said) = warning.split_once(": ").unwrap_or(("", warning));
    said.chars().filter(|character| !character.is_ascii_digit() && !"+-.".contains(*character)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shortened_list(warnings: &[&str]) -> Vec<String> {
        shortened(warnings.iter().map(|warning| (*warning).to_owned()))
    }

    #[test]
    fn of_many_alike_the_first_few_are_shown() {
        let alike: Vec<String> =
            (0..9).map(|i| format!("box {i}: {} triangles without area were left out", i + 2)).collect();
        let mut warnings: Vec<&str> = alike.iter().map(String::as_str).collect();
        warnings.insert(1, "floor: its texture is coarse");
        warnings.push("3 triangles lie exactly on others");
        let expected = [
            "box 0: 2 triangles without area were left out",
            "box 1: 3 triangles without area were left out",
            "box 2: 4 triangles without area were left out",
            "6 more warnings like these (--json lists those of the bake)",
            "floor: its texture is coarse",
            "3 triangles lie exactly on others",
        ];
        assert_eq!(shortened_list(&warnings), expected);
    }

    #[test]
    fn few_warnings_are_all_shown_and_nothing_is_lost() {
        let few = ["a: 1 hole", "b: 2 hole", "c: 3 hole", "d: 4 hole"];
        assert_eq!(shortened_list(&few), few);
        assert_eq!(shortened_list(&[]), [""; 0]);
    }
}
