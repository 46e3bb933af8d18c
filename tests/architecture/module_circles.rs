//! Checks that the modules of a crate import each other downwards only, and the stages of a bake only those before
//! them. The imports are read from the sources, including re-exports at the crate's root. Dependencies between crates,
//! and between the files within a module, are not checked here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use syn::visit::{self, Visit};

/// For each module directly below a crate's root, the siblings that it imports, each with a file that imports it.
type Imports = BTreeMap<String, BTreeMap<String, String>>;

/// The sources of a crate: each file's path below `src`, without its extension, and its text.
type Sources = Vec<(String, String)>;

/// Collects the paths of a file that start at the crate's root.
struct Paths<'a> {
    /// Modules from the root to the file's own.
    own: &'a [String],
    found: Vec<Vec<String>>,
}

impl Paths<'_> {
    /// Adds `crate::a::b` and `super::a::b` as `[a, b]`, from the root.
    fn add(&mut self, path: &[String]) {
        let Some((first, rest)) = path.split_first() else { return };
        if first == "crate" {
            self.found.push(rest.to_vec());
        }
        if first == "super" {
            let ups = path.iter().take_while(|segment| *segment == "super").count();
            let kept = self.own.len().saturating_sub(ups);
            self.found.push([&self.own[..kept], &path[ups..]].concat());
        }
    }

    fn add_tree(&mut self, tree: &syn::UseTree, mut before: Vec<String>) {
        match tree {
            syn::UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.add_tree(&path.tree, before);
            }
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|item| self.add_tree(item, before.clone()));
            }
            syn::UseTree::Name(name) => {
                before.push(name.ident.to_string());
                self.add(&before);
            }
            syn::UseTree::Rename(name) => {
                before.push(name.ident.to_string());
                self.add(&before);
            }
            syn::UseTree::Glob(_) => self.add(&before),
        }
    }
}

/// Tests may import upwards, as they compare with what is built on top.
fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    let tests = |attribute: &syn::Attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test"))
    };
    attributes.iter().any(tests)
}

impl<'ast> Visit<'ast> for Paths<'_> {
    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        if !is_for_tests(&module.attrs) {
            visit::visit_item_mod(self, module);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if !is_for_tests(&item.attrs) {
            self.add_tree(&item.tree, Vec::new());
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.add(&segments);
        visit::visit_path(self, path);
    }
}

/// Returns which names the root re-exports from its modules: `pub use error::BakeError` is `BakeError` of `error`.
fn named_at_root(root: &syn::File) -> BTreeMap<String, String> {
    fn leaves(tree: &syn::UseTree, module: Option<&str>, found: &mut BTreeMap<String, String>) {
        let mut add = |name: &syn::Ident| {
            found.extend(module.map(|module| (name.to_string(), module.to_owned())));
        };
        match tree {
            syn::UseTree::Path(path) if path.ident == "crate" || path.ident == "self" => {
                leaves(&path.tree, module, found);
            }
            syn::UseTree::Path(path) => {
                let first = path.ident.to_string();
                leaves(&path.tree, Some(module.unwrap_or(&first)), found);
            }
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| leaves(item, module, found)),
            syn::UseTree::Name(name) => add(&name.ident),
            syn::UseTree::Rename(name) => add(&name.rename),
            syn::UseTree::Glob(_) => {}
        }
    }
    let mut found = BTreeMap::new();
    for item in &root.items {
        if let syn::Item::Use(item) = item {
            leaves(&item.tree, None, &mut found);
        }
    }
    found
}

/// Finds what the modules of a crate import.
fn imports(sources: &Sources) -> Result<Imports, syn::Error> {
    let files: Vec<(Vec<String>, syn::File)> = sources
        .iter()
        .map(|(path, text)| {
            let mut own: Vec<String> = path.split('/').map(str::to_owned).collect();
            if own.last().is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str())) {
                own.pop();
            }
            Ok((own, syn::parse_file(text)?))
        })
        .collect::<Result<_, syn::Error>>()?;
    let at_root: BTreeMap<String, String> =
        files.iter().filter(|(own, _)| own.is_empty()).flat_map(|(_, root)| named_at_root(root)).collect();
    let modules: BTreeSet<&String> = files.iter().filter_map(|(own, _)| own.first()).collect();
    let mut imports = Imports::new();
    for (own, file) in &files {
        let is_test = own.last().is_some_and(|last| last.ends_with("_tests") || last == "tests");
        let Some(module) = own.first().filter(|_| !is_test) else { continue };
        let mut paths = Paths { own, found: Vec::new() };
        paths.visit_file(file);
        let firsts = paths.found.iter().filter_map(|path| path.first());
        for name in
            firsts.map(|first| at_root.get(first).filter(|_| !modules.contains(first)).unwrap_or(first))
        {
            if modules.contains(name) && name != module {
                let of_module = imports.entry(module.clone()).or_default();
                of_module.entry(name.clone()).or_insert_with(|| own.join("/"));
            }
        }
    }
    Ok(imports)
}

/// Returns descriptions of the circular imports.
fn circles(imports: &Imports) -> Vec<String> {
    let reaches = |from: &str, to: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            for next in imports.get(module).into_iter().flat_map(BTreeMap::keys) {
                if seen.insert(next.as_str()) {
                    open.push(next);
                }
            }
        }
        seen.contains(to)
    };
    let mut found = Vec::new();
    for (module, imported) in imports {
        for (other, file) in imported {
            if reaches(other, module) {
                found.push(format!("{module} imports {other} (in {file}), which leads back to {module}"));
            }
        }
    }
    found
}

fn sources_below(folder: &Path, before: &str, sources: &mut Sources) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for entry in entries {
        let path = entry.expect("an entry of a folder can be read").path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let name = if before.is_empty() { stem.to_owned() } else { format!("{before}/{stem}") };
        if path.is_dir() {
            sources_below(&path, &name, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.push((name, std::fs::read_to_string(&path).expect("a source file is text")));
        }
    }
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    let crates = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates"));
    let mut read = 0;
    for entry in std::fs::read_dir(crates).expect("the workspace has crates") {
        let folder = entry.expect("an entry of a folder can be read").path();
        let mut sources = Sources::new();
        sources_below(&folder.join("src"), "", &mut sources);
        read += sources.len();
        let imports = imports(&sources).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let circles = circles(&imports);
        assert!(circles.is_empty(), "{}:\n{}", folder.display(), circles.join("\n"));
    }
    assert!(read > 200, "only {read} files were read");
}

#[test]
fn a_circle_is_seen_and_a_test_may_look_upwards() {
    let file = |path: &str, text: &str| (path.to_owned(), text.to_owned());
    let root = || file("lib", "mod high; mod low; pub use high::Tall;");
    let found = |low: &str| {
        let sources = vec![
            root(),
            file("high/mod", "mod inner;"),
            file("high/inner", "use super::super::low::Short;"),
            file("low", low),
        ];
        circles(&imports(&sources).expect("these can be parsed"))
    };
    assert_eq!(found("pub struct Short;"), Vec::<String>::new());
    // By its module, by the name at the root, within a path, and from an inner module.
    for upwards in [
        "use crate::high::Tall;",
        "use crate::{Tall as Long};",
        "fn f() -> crate::Tall { super::high::make() }",
        "mod inner { use crate::high::inner; }",
    ] {
        assert_eq!(found(upwards).len(), 2, "{upwards}");
    }
    for harmless in ["#[cfg(test)] mod tests { use crate::Tall; }", "#[cfg(test)] use crate::high::Tall;"] {
        assert_eq!(found(harmless), Vec::<String>::new(), "{harmless}");
    }
}

/// Returns the folders that the bold headings of a page name, in order: "**It arrives: `direct_light/`.** …".
fn folders_of_headings(page: &str) -> Vec<&str> {
    let headings = page.lines().filter_map(|line| line.strip_prefix("**")?.split_once("**"));
    headings.flat_map(|(heading, _)| heading.split('`')).filter_map(|code| code.strip_suffix('/')).collect()
}

/// Returns descriptions of the imports by which a module depends on one that comes later in an order. Modules that the
/// order does not name may be imported by all.
fn imports_of_later(order: &[&str], imports: &Imports) -> Vec<String> {
    let mut found = Vec::new();
    for (place, module) in order.iter().enumerate() {
        for (other, file) in imports.get(*module).into_iter().flatten() {
            if order[place..].contains(&other.as_str()) {
                found.push(format!("{module} imports {other} (in {file}), which comes later"));
            }
        }
    }
    found
}

#[test]
fn stages_of_a_bake_import_only_those_before_them() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let page = std::fs::read_to_string(root.join("docs/baking.md")).expect("the page on baking exists");
    let order = folders_of_headings(&page);
    let folder = root.join("crates/lumbre_bake/src");
    let mut folders: Vec<String> = std::fs::read_dir(&folder)
        .expect("the baker has sources")
        .map(|entry| entry.expect("an entry of a folder can be read"))
        .filter(|entry| entry.path().is_dir())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    folders.sort_unstable();
    let mut named = order.clone();
    named.sort_unstable();
    assert_eq!(named, folders, "the page names every folder once");
    let mut sources = Sources::new();
    sources_below(&folder, "", &mut sources);
    let imports = imports(&sources).expect("the sources can be parsed");
    let later = imports_of_later(&order, &imports);
    assert!(later.is_empty(), "{}", later.join("\n"));
    // Control: in the reverse order nearly every import is of a later folder.
    let reversed: Vec<&str> = order.iter().rev().copied().collect();
    assert!(imports_of_later(&reversed, &imports).len() > order.len());
}

#[test]
fn an_import_of_a_later_stage_is_seen() {
    let page =
        "**First: `low/`.** Text with `other/` in it.\n\n**Then: `high/`, `top/`.** More.\n**No folder.**\n";
    let order = folders_of_headings(page);
    assert_eq!(order, ["low", "high", "top"]);
    let file = |path: &str, text: &str| (path.to_owned(), text.to_owned());
    let found = |low: &str| {
        let root = file("lib", "mod high; mod low; mod top;");
        let sources =
            vec![root, file("low", low), file("high", "use crate::low::Short;"), file("top/mod", "")];
        imports_of_later(&order, &imports(&sources).expect("these can be parsed"))
    };
    assert_eq!(found("pub struct Short;"), Vec::<String>::new());
    assert_eq!(found("use crate::top::Tall;"), ["low imports top (in low), which comes later"]);
}
