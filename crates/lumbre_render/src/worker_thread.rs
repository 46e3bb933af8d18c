//! A thread for what no frame waits for. What is made on it is `deferred`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

type Job = Box<dyn FnOnce() + Send>;

/// The thread, started when there is something to do.
#[derive(Debug, Default)]
pub(crate) struct WorkerThread(Mutex<Option<Running>>);

#[derive(Debug)]
struct Running {
    jobs: Sender<Job>,
    /// What is still to be done is wanted by nobody.
    ends: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl WorkerThread {
    /// Does it after what was handed over before; here, where there can be no thread.
    pub fn run(&self, job: Job) {
        let Ok(mut worker) = self.0.lock() else { return job() };
        if worker.is_none() {
            *worker = Running::start();
        }
        let refused = match &*worker {
            Some(worker) => worker.jobs.send(job).err().map(|refused| refused.0),
            None => Some(job),
        };
        drop(worker);
        // There is no thread: it is done here.
        if let Some(job) = refused {
            job();
        }
    }
}

impl Drop for WorkerThread {
    fn drop(&mut self) {
        let Some(Running { jobs, ends, thread }) = self.0.get_mut().ok().and_then(Option::take) else {
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

impl Running {
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
