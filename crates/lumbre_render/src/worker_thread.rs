//! A worker thread for jobs that no frame waits for. What is created on it is described in `pending`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

type Job = Box<dyn FnOnce() + Send>;

/// The thread, which is started with the first job.
#[derive(Debug, Default)]
pub(crate) struct WorkerThread(Mutex<Option<Running>>);

#[derive(Debug)]
struct Running {
    jobs: Sender<Job>,
    /// Set on drop: the queued jobs are no longer needed.
    ends: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl WorkerThread {
    /// Runs a job on the thread after those that were queued before, or on this thread if no thread can be
    /// started.
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
        // There is no thread.
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
        // Wait, because a process that exits while a driver compiles may crash. But if the thread itself held
        // the last reference to the device, it cannot join itself.
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
