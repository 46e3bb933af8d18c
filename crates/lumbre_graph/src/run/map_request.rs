//! Requests to map a buffer for reading. wgpu calls back on whichever thread polls the device. A thread may find
//! nothing left to poll for while another thread has not run the callback yet, so a request waits for the callback
//! itself.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long to wait for a callback that another thread has yet to run.
const LONGEST_HANDOVER: Duration = Duration::from_secs(10);

/// The state of a [`MapRequest`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapState {
    /// Not answered yet.
    #[default]
    Waiting,
    /// The buffer is mapped.
    Arrived,
    /// The device was lost, or the buffer destroyed.
    Failed,
}

/// A request to map a buffer, so that the program can read it once the GPU has written it.
#[derive(Clone, Debug, Default)]
pub struct MapRequest(Arc<(Mutex<MapState>, Condvar)>);

impl MapRequest {
    /// Requests to map a whole buffer for reading. The request is answered while any thread polls the device.
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

    /// Returns the current state without waiting.
    #[must_use]
    pub fn state(&self) -> MapState {
        *self.lock()
    }

    /// Waits for the answer. Call it after polling the device until the buffer's submission was done; some thread
    /// then has the answer. The result is only [`MapState::Waiting`] if that thread is stuck for ten seconds.
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
