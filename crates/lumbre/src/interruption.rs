//! Handles Ctrl-C and other termination signals: work that can save its state is asked to stop, and at any
//! other time the process ends at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The state that the handler shares with the program.
#[derive(Default)]
struct State {
    asked: AtomicBool,
    /// Whether work is running that checks `asked`.
    listening: AtomicBool,
    /// Message to print before the process ends.
    words: Mutex<String>,
}

/// The signal handler of this process.
pub struct Interruption(Arc<State>);

impl Interruption {
    /// Installs the handler. If that fails, an interruption ends the process at once, and a warning says so.
    pub fn handle() -> Self {
        let state = Arc::new(State::default());
        let of_handler = Arc::clone(&state);
        let handled = ctrlc::set_handler(move || {
            // A second request ends the process at once.
            let twice = of_handler.asked.swap(true, Ordering::SeqCst);
            if twice || !of_handler.listening.load(Ordering::SeqCst) {
                eprintln!("lumbre: {}", of_handler.words.lock().unwrap_or_else(PoisonError::into_inner));
                std::process::exit(1);
            }
        });
        if let Err(error) = handled {
            eprintln!(
                "lumbre: warning: an interruption will end the work at once, without saving it: {error}"
            );
        }
        Self(state)
    }

    /// Sets the message to print if the process is ended by an interruption.
    pub fn say(&self, words: String) {
        *self.0.words.lock().unwrap_or_else(PoisonError::into_inner) = words;
    }

    /// Runs work with a function that returns true once it is asked to stop.
    pub fn told<T>(&self, work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T) -> T {
        self.0.listening.store(true, Ordering::SeqCst);
        let result = work(&|| self.0.asked.load(Ordering::SeqCst));
        self.0.listening.store(false, Ordering::SeqCst);
        result
    }
}
