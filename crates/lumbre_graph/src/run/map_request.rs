//! Asking for a buffer's bytes in memory. wgpu answers from whichever thread polls the device: one thread may find
//! nothing left to poll for while another is still on its way to the answer, so the answer itself is what is waited for.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long an answer may take that another thread holds in its hand, before it is given up.
const LONGEST_HANDOVER: Duration = Duration::from_secs(10);

/// What became of a [`MapRequest`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapState {
    /// Nothing is known yet.
    #[default]
    Waiting,
    /// The buffer is mapped.
    Arrived,
    /// The device was lost, or the buffer destroyed.
    Failed,
}

/// A buffer that was asked for, to be read by this program once the GPU has written it.
#[derive(Clone, Debug, Default)]
pub struct MapRequest(Arc<(Mutex<MapState>, Condvar)>);

impl MapRequest {
    /// Asks for the whole of a buffer, to be read. It is answered while the device is polled, by any thread.
    #[must_use]
    pub fn new(buffer: &wgpu::Buffer) -> Self {
        let request = Self::default();
        let answered = request.clone();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            *answered.lock() = if result.is_ok() { MapState::Arrived } else { MapState::Failed };
            answered.0.1.notify_all();
        });
        request
    }

    /// What is known now; does not wait.
    #[must_use]
    pub fn state(&self) -> MapState {
        *self.lock()
    }

    /// Waits for the answer, after the device was polled until the buffer's submission was done: by then some thread has
    /// the answer. [`MapState::Waiting`] only if that thread stood still for ten seconds.
    #[must_use]
    pub fn wait(&self) -> MapState {
        let (state, _) = self
            .0
            .1
            .wait_timeout_while(self.lock(), LONGEST_HANDOVER, |state| *state == MapState::Waiting)
            .unwrap_or_else(PoisonError::into_inner);
        *state
    }

    fn lock(&self) -> MutexGuard<'_, MapState> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
