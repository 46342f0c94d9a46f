//! Hot reload: a thread watches GLSL files, and reports the result of saved ones.

use std::path::Path;
use std::time::Duration;

use twobounce::vk::Reload;
use winit::event_loop::EventLoopProxy;

use super::job::News;
use crate::cli::threads;
use crate::say;

/// The GLSL folder of the source from which the program was built.
const OWN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/glsl");
/// The interval of checks.
const EVERY: Duration = Duration::from_millis(200);

/// Watches the folder, or that of the program's source if it exists, and reports each change.
pub fn begin(folder: Option<&Path>, news: EventLoopProxy<News>) -> twobounce::Result<()> {
    let folder = match folder {
        Some(folder) => folder,
        None if !Path::new(OWN).exists() => return Ok(()),
        None => Path::new(OWN),
    };
    let mut watched = Reload::watch(folder)?;
    say!("watches {}", folder.display());
    threads::spawn(move || {
        loop {
            let changed = watched.look().map(|result| result.map_err(|error| error.to_string()));
            if changed.is_some_and(|said| news.send_event(News::Shaders(said)).is_err()) {
                return; // the window is closed
            }
            std::thread::sleep(EVERY);
        }
    })?;
    Ok(())
}
