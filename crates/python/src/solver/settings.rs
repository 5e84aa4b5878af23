//! Settings that bundle adjustment and pose graphs share, and the work without the interpreter.

use crate::errors::{Kind, exception};
use pyo3::prelude::*;
use sphereflow_solver::{Options, StopFlag};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Time between looks for Ctrl-C while the solver works.
const LOOK: Duration = Duration::from_millis(50);

/// Settings that bundle adjustment and pose graphs share.
pub struct Settings {
    pub options: Options,
    threads: usize,
}

impl Settings {
    pub fn new(
        max_iterations: usize,
        [function_tolerance, parameter_tolerance]: [f64; 2],
        time_budget_s: Option<f64>,
        threads: usize,
    ) -> PyResult<Self> {
        let seconds = |s: f64| {
            let text = format!("time_budget_s: expected seconds, 0 or more, found {s}");
            Duration::try_from_secs_f64(s).map_err(|_| exception(Kind::Value, text))
        };
        Ok(Self {
            options: Options {
                max_iterations,
                function_tolerance,
                parameter_tolerance,
                time_budget: time_budget_s.map(seconds).transpose()?,
                stop: StopFlag::new(),
                ..Options::default()
            },
            threads,
        })
    }

    /// Work without the interpreter, on so many threads (0: all); Ctrl-C raises the stop flag.
    pub fn run<T: Send>(&self, py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build()
            .map_err(|error| exception(Kind::Value, format!("threads: {error}")))?;
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let receiver = std::sync::Mutex::new(receiver);
            scope.spawn(move || {
                // nobody listens any more only where the interpreter was interrupted
                let _ = sender.send(pool.install(work));
            });
            let mut interrupted = None;
            loop {
                let answer = py.detach(|| match receiver.lock() {
                    Ok(receiver) => receiver.recv_timeout(LOOK),
                    Err(_) => Err(RecvTimeoutError::Disconnected),
                });
                match (answer, interrupted.take()) {
                    (Ok(_), Some(error)) => return Err(error),
                    (Ok(result), None) => return Ok(result),
                    (Err(RecvTimeoutError::Disconnected), _) => {
                        return Err(pyo3::exceptions::PyRuntimeError::new_err(
                            "the solver failed",
                        ));
                    }
                    (Err(RecvTimeoutError::Timeout), before) => {
                        interrupted = before.or_else(|| py.check_signals().err());
                        if interrupted.is_some() {
                            self.options.stop.raise();
                        }
                    }
                }
            }
        })
    }
}
