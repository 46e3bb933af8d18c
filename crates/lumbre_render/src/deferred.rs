//! Things that take long to make, above all pipelines, made on a thread of the device's own while frames go on without them. Not when a frame goes on and when it waits:
//! that is `options::MissingPipelines`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::JoinHandle;

use crate::{EffectError, Gpu};

/// Something that is made once: there, on its way, or impossible.
#[derive(Debug)]
pub struct Deferred<T>(Arc<OnceLock<Result<T, EffectError>>>);

impl<T: Send + Sync + 'static> Deferred<T> {
    /// Begins to make it on the device's thread, after what was begun before.
    pub fn begin(gpu: &Gpu, make: impl FnOnce() -> Result<T, EffectError> + Send + 'static) -> Self {
        let place = Arc::new(OnceLock::new());
        let made = Arc::clone(&place);
        gpu.background().run(Box::new(move || {
            // Whoever waits is answered whatever happens.
            let result = catch_unwind(AssertUnwindSafe(make));
            let _ = made.set(result.unwrap_or_else(|_| Err("its making has panicked".into())));
        }));
        Self(place)
    }

    /// Makes it at once.
    pub fn make(make: impl FnOnce() -> Result<T, EffectError>) -> Self {
        Self(Arc::new(OnceLock::from(make())))
    }

    /// What became of it, or nothing yet.
    pub fn get(&self) -> Option<Result<&T, &EffectError>> {
        self.0.get().map(Result::as_ref)
    }

    /// What becomes of it.
    pub fn wait(&self) -> Result<&T, &EffectError> {
        self.0.wait().as_ref()
    }

    /// Whether it is there; with `wait` it is waited for.
    ///
    /// # Errors
    /// It cannot be made; the words of the fault.
    pub fn is_there(&self, wait: bool) -> Result<bool, String> {
        let result = if wait { Some(self.wait()) } else { self.get() };
        match result {
            None => Ok(false),
            Some(Ok(_)) => Ok(true),
            Some(Err(error)) => Err(error.to_string()),
        }
    }
}

type Job = Box<dyn FnOnce() + Send>;

/// The thread that deferred things are made on, started when there is one.
#[derive(Debug, Default)]
pub(crate) struct Background(Mutex<Option<Worker>>);

#[derive(Debug)]
struct Worker {
    jobs: Sender<Job>,
    /// What is still to be made is wanted by nobody.
    ends: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Background {
    fn run(&self, job: Job) {
        let Ok(mut worker) = self.0.lock() else { return job() };
        if worker.is_none() {
            *worker = Worker::start();
        }
        let refused = match &*worker {
            Some(worker) => worker.jobs.send(job).err().map(|refused| refused.0),
            None => Some(job),
        };
        drop(worker);
        // There is no thread: it is made here.
        if let Some(job) = refused {
            job();
        }
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        let Some(Worker { jobs, ends, thread }) = self.0.get_mut().ok().and_then(Option::take) else {
            return;
        };
        ends.store(true, Ordering::Relaxed);
        drop(jobs);
        // A program that ends while a driver compiles may end badly. The last to hold the device may be the thread itself.
        if thread.thread().id() != std::thread::current().id() {
            let _ = thread.join();
        }
    }
}

impl Worker {
    fn start() -> Option<Self> {
        let (jobs, queue) = channel();
        let ends = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&ends);
        let builder = std::thread::Builder::new().name("pipelines".to_owned());
        let thread = builder.spawn(move || work(&queue, &told)).ok()?;
        Some(Self { jobs, ends, thread })
    }
}

fn work(queue: &Receiver<Job>, ends: &AtomicBool) {
    while let Ok(job) = queue.recv() {
        if ends.load(Ordering::Relaxed) {
            return;
        }
        job();
    }
}
