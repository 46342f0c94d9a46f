//! Hot reload: looks for GLSL that was saved, on a thread, and says what came of it.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use twobounce::vk::Reload;
use winit::event_loop::EventLoopProxy;

use crate::say;

/// The GLSL of the source that the program was built from.
const OWN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/glsl");
/// Files are looked at this often.
const EVERY: Duration = Duration::from_millis(200);

/// It ends when this is dropped.
pub struct Reloading {
    ends: Arc<AtomicBool>,
    said: Said,
}

/// How many shaders are new, or what is wrong.
type Said = Arc<Mutex<Option<Result<usize, String>>>>;

impl Reloading {
    /// Watches the folder, or that of the program's source where there is one; `wake` is told of each change.
    pub fn begin(folder: Option<&Path>, wake: EventLoopProxy<()>) -> twobounce::Result<Option<Self>> {
        let watched = match folder {
            Some(folder) => Reload::watch(folder)?,
            None if !Path::new(OWN).exists() => return Ok(None),
            None => Reload::watch(Path::new(OWN))?,
        };
        say!("watches {}", folder.unwrap_or(Path::new(OWN)).display());
        let (ends, said) = (Arc::<AtomicBool>::default(), Said::default());
        let own = Self { ends: ends.clone(), said: said.clone() };
        std::thread::spawn(move || look(watched, &ends, &said, &wake));
        Ok(Some(own))
    }

    /// What came of the last change, once.
    pub fn take(&self) -> Option<Result<usize, String>> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Reloading {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
    }
}

fn look(mut watched: Reload, ends: &AtomicBool, said: &Said, wake: &EventLoopProxy<()>) {
    while !ends.load(Ordering::Relaxed) {
        if let Some(result) = watched.look() {
            let result = result.map_err(|error| error.to_string());
            *said.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
            if wake.send_event(()).is_err() {
                return; // the window is closed
            }
        }
        std::thread::sleep(EVERY);
    }
}
