//! From WESL modules and features to the WGSL of one program: imports resolved, conditions decided. Not the check of what comes out: that
//! is the device's, or naga's.
//!
//! The compiler of WESL is generic code. It stands behind this one function, so that it is built once and not in every crate that
//! compiles shaders.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::MODULES;

/// Why a program has no WGSL: the compiler's words, which name module and place.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WeslError(String);

/// What holds for features that modules ask about and nobody named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnnamedFeatures {
    /// They are off.
    AreOff,
    /// They are a slip, and refused.
    AreErrors,
}

/// Which declarations a program keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept<'a> {
    /// The entry points and what they reach.
    EntryPoints,
    /// The declarations of the root module that have these names, and what they reach.
    Declarations(&'a [&'a str]),
    /// The whole root module and what it reaches.
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
    /// What holds for the others.
    pub unnamed: UnnamedFeatures,
    /// Which declarations it keeps.
    pub kept: Kept<'a>,
}

impl Program<'_> {
    /// The program in WGSL.
    ///
    /// # Errors
    /// If a path or a module does not parse, an import leads nowhere, or a feature is unnamed that has to be named.
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

/// What was compiled of the embedded modules, by root and features that are on. A program asks for the same variants again for each renderer and device; each takes
/// milliseconds to compile, and has some tens of kilobytes.
static COMPILED: Mutex<BTreeMap<String, Arc<str>>> = Mutex::new(BTreeMap::new());

/// One of the embedded modules in WGSL, with exactly these features. Compiled once in a process.
///
/// # Errors
/// As [`Program::to_wgsl`].
pub fn to_wgsl(root: &str, features: &[(&str, bool)]) -> Result<Arc<str>, WeslError> {
    let on = features.iter().filter(|(_, on)| *on).map(|(name, _)| *name);
    let key = std::iter::once(root).chain(on).collect::<Vec<_>>().join(" ");
    // What another thread left is whole, whatever became of that thread.
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
    // A feature that nobody named is a slip of ours, not a feature that is off.
    let unnamed = UnnamedFeatures::AreErrors;
    Program { modules: &modules, root, features, unnamed, kept: Kept::EntryPoints }.to_wgsl()
}

fn module_path(path: &str) -> Result<wesl::syntax::ModulePath, WeslError> {
    let full = format!("package::{}", path.replace('/', "::"));
    full.parse().map_err(|error| WeslError(format!("{full}: {error}")))
}
