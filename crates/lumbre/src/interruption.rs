//! Ctrl-C, and what else asks a process to end: while something runs that keeps its work it is told, at any other time the process ends at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What was asked, and what to do about it.
#[derive(Default)]
struct State {
    asked: AtomicBool,
    /// Something runs that looks at `asked`.
    listening: AtomicBool,
    /// What to say before the process ends.
    words: Mutex<String>,
}

/// The handler of a process.
pub struct Interruption(Arc<State>);

impl Interruption {
    /// Takes over. Where that cannot be, an interruption ends the process at once, and a warning says so.
    pub fn handle() -> Self {
        let state = Arc::new(State::default());
        let of_handler = Arc::clone(&state);
        let handled = ctrlc::set_handler(move || {
            // Whoever asks twice does not want to wait.
            let twice = of_handler.asked.swap(true, Ordering::SeqCst);
            if twice || !of_handler.listening.load(Ordering::SeqCst) {
                eprintln!("lumbre: {}", of_handler.words.lock().unwrap_or_else(PoisonError::into_inner));
                std::process::exit(1);
            }
        });
        if let Err(error) = handled {
            eprintln!("lumbre: warning: an interruption will end the bake at once: {error}");
        }
        Self(state)
    }

    /// Says so from now on, if the process ends by an interruption.
    pub fn say(&self, words: String) {
        *self.0.words.lock().unwrap_or_else(PoisonError::into_inner) = words;
    }

    /// Does something that is told, by its argument, whether it was asked to end.
    pub fn told<T>(&self, work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T) -> T {
        self.0.listening.store(true, Ordering::SeqCst);
        let result = work(&|| self.0.asked.load(Ordering::SeqCst));
        self.0.listening.store(false, Ordering::SeqCst);
        result
    }
}
