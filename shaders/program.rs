//! Compiles WESL modules with a set of features to the WGSL of one program: imports are resolved and
//! conditions are evaluated. The result is validated by the device or by naga, not here.
//!
//! The WESL compiler is generic code. It is wrapped in this one function, so that it is compiled only once
//! and not in every crate that compiles shaders.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::MODULES;

/// Why a program could not be compiled: the compiler's message, which names module and position.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WeslError(String);

/// How features are treated that modules use and that were not named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnnamedFeatures {
    /// They are off.
    AreOff,
    /// They are an error.
    AreErrors,
}

/// Which declarations a program keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept<'a> {
    /// The entry points and what they use.
    EntryPoints,
    /// The declarations of the root module with these names, and what they use.
    Declarations(&'a [&'a str]),
    /// The whole root module and what it uses.
    RootModule,
}

/// A program before it is compiled.
#[derive(Clone, Debug)]
pub struct Program<'a> {
    /// Path, without `package::` and with slashes, and source of every module that may be imported.
    pub modules: &'a [(&'a str, Cow<'a, str>)],
    /// Path of the module that is compiled.
    pub root: &'a str,
    /// Features by name, on or off.
    pub features: &'a [(&'a str, bool)],
    /// How other features are treated.
    pub unnamed: UnnamedFeatures,
    /// Which declarations it keeps.
    pub kept: Kept<'a>,
}

impl Program<'_> {
    /// Compiles the program to WGSL.
    ///
    /// # Errors
    /// Returns an error if a path or a module does not parse, an import cannot be resolved, or a feature is
    /// not named although [`UnnamedFeatures::AreErrors`] is set.
    pub fn to_wgsl(&self) -> Result<String, WeslError> {
        let mut resolver = wesl::VirtualResolver::new();
        for (path, source) in self.modules {
            resolver.add_module(module_path(path)?, Cow::Borrowed(source.as_ref()));
        }
        let mut compiler = wesl::Wesl::new_barebones().set_custom_resolver(resolver);
        compiler.set_mangler(wesl::ManglerKind::Escape).set_options(wesl::CompileOptions {
            imports: true,
            condcomp: true,
            strip: self.kept != Kept::RootModule,
            lazy: true,
            ..Default::default()
        });
        if let Kept::Declarations(names) = self.kept {
            compiler.keep_declarations(names.iter().map(|name| (*name).to_owned()).collect());
        }
        if self.unnamed == UnnamedFeatures::AreErrors {
            compiler.set_missing_feature_behavior(wesl::Feature::Error);
        }
        for (name, on) in self.features {
            compiler.set_feature(name, *on);
        }
        let program = compiler.compile(&module_path(self.root)?);
        program.map(|program| program.to_string()).map_err(|error| WeslError(error.to_string()))
    }
}

/// The compiled embedded modules, by root and named features. A program needs the same variants again
/// for each renderer and device; each takes milliseconds to compile and has some tens of kilobytes.
static COMPILED: Mutex<BTreeMap<String, Arc<str>>> = Mutex::new(BTreeMap::new());

/// Compiles one of the embedded modules to WGSL with exactly these features. The result is cached for the
/// lifetime of the process.
///
/// # Errors
/// The same as those of [`Program::to_wgsl`].
pub fn to_wgsl(root: &str, features: &[(&str, bool)]) -> Result<Arc<str>, WeslError> {
    // Features that are off belong to the key too: one that is not named is an error, which the result for the
    // same features with that one off must not hide.
    let states = features.iter().flat_map(|(name, on)| [if *on { " +" } else { " -" }, *name]);
    let key: String = std::iter::once(root).chain(states).collect();
    // The map is valid even if another thread panicked while it held the lock.
    let compiled = || COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(wgsl) = compiled().get(&key) {
        return Ok(Arc::clone(wgsl));
    }
    let wgsl: Arc<str> = compile(root, features)?.into();
    compiled().insert(key, Arc::clone(&wgsl));
    Ok(wgsl)
}

fn compile(root: &str, features: &[(&str, bool)]) -> Result<String, WeslError> {
    let modules: Vec<_> = MODULES.iter().map(|(path, source)| (*path, Cow::Borrowed(*source))).collect();
    // A feature that is not named is a mistake in the caller, not a feature that is off.
    let unnamed = UnnamedFeatures::AreErrors;
    Program { modules: &modules, root, features, unnamed, kept: Kept::EntryPoints }.to_wgsl()
}

fn module_path(path: &str) -> Result<wesl::syntax::ModulePath, WeslError> {
    let full = format!("package::{}", path.replace('/', "::"));
    full.parse().map_err(|error| WeslError(format!("{full}: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feature_that_is_not_named_is_an_error_whatever_was_compiled_before() {
        let all = ["DISPLAY_SRGB", "DISPLAY_CLAMP", "ENCODE_SRGB", "DECODE_SRGB", "VIEWPORT"];
        let off = all.map(|name| (name, false));
        assert!(to_wgsl("display", &off).is_ok());
        for missing in 0..all.len() {
            let others: Vec<_> = (0..all.len()).filter(|&at| at != missing).map(|at| off[at]).collect();
            let found = to_wgsl("display", &others);
            assert!(found.is_err_and(|error| error.to_string().contains(all[missing])), "{}", all[missing]);
        }
        let mut on = off;
        on[4].1 = true;
        assert_ne!(to_wgsl("display", &off).unwrap(), to_wgsl("display", &on).unwrap());
    }
}
