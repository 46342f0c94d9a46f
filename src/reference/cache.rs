//! A cache of references between runs: films, stored under a hash of everything that determines their samples.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bytemuck::{AnyBitPattern, cast_slice, pod_read_unaligned};

use super::film::{Film, Pixel};
use super::{Control, Depth, Options, Progress, VERSION, render};
use crate::output::file;
use crate::scene::{Pose, Scene, View};
use crate::{Error, Result};

/// The first bytes of a film's file; the last one is the version of the format.
const MAGIC: [u8; 8] = *b"2bfilm\0\x02";

/// A crash loses at most this much work.
const SAVE_EVERY: Duration = Duration::from_secs(30);

/// A folder of films.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The folder `TWOBOUNCE_CACHE`, else `twobounce` in `XDG_CACHE_HOME`, else `twobounce` in `~/.cache`.
    pub fn of_user() -> Result<Self> {
        let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let folder = set("TWOBOUNCE_CACHE")
            .or_else(|| set("XDG_CACHE_HOME").map(|d| d.join("twobounce")))
            .or_else(|| set("HOME").map(|d| d.join(".cache/twobounce")));
        folder.map(Self::at).ok_or_else(|| {
            Error::Usage("there is no folder for the cache of references; set TWOBOUNCE_CACHE to a folder".to_owned())
        })
    }

    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The finished film for `options`: from the cache, or rendered from the state in the cache on. After `cancel` is set, the
    /// finished part is saved and the result is [`Error::Interrupted`].
    pub fn render(
        &self,
        of: (&Scene, &Pose, &View),
        options: &Options,
        progress: &(dyn Fn(Progress) + Sync),
        cancel: &AtomicBool,
    ) -> Result<Film> {
        std::fs::create_dir_all(&self.folder).map_err(|e| {
            Error::file(&self.folder, format!("cannot be created: {e}; set TWOBOUNCE_CACHE to another folder"))
        })?;
        let key = key(of, options);
        let path = self.folder.join(format!("{}.film", key.to_hex()));
        let mut film = match load(&path, &key, options) {
            Some(film) if !options.stop.passed(&film) => film,
            _ => Film::new(options.width, options.height),
        };
        let mut saved = Instant::now();
        let mut save = |film: &Film| {
            let finished = options.stop.reached(film);
            if !(finished || cancel.load(Ordering::Relaxed) || saved.elapsed() > SAVE_EVERY) {
                return Ok(());
            }
            saved = Instant::now();
            let _writing = file::writing();
            match file::write(&path, &encode(film, &key)) {
                // The film is finished: a failure to save it only costs time in the next run.
                Err(error) if finished => tracing::warn!("the reference could not be saved in the cache: {error}"),
                other => other?,
            }
            Ok(())
        };
        render(of, options, &mut film, Control { progress, save: &mut save, cancel })?;
        Ok(film)
    }
}

/// A hash of everything that determines the samples. [`Options::stop`] is left out: it does not change a sample.
pub fn key((scene, pose, view): (&Scene, &Pose, &View), options: &Options) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    let depth = match options.depth {
        Depth::Full => "full".to_owned(),
        Depth::Bounces(n) => n.to_string(),
    };
    let Options { width, height, seed, occlusion, .. } = options;
    add(format!("twobounce reference {VERSION}: {width}x{height} depth {depth} seed {seed} ao {occlusion}").as_bytes());
    // Debug prints floats with enough digits to distinguish them.
    add(format!("{view:?} {pose:?} {:?} {:?} {:?}", scene.sky, scene.instances, scene.textures).as_bytes());
    if scene.sky_gradient != glam::Vec3::ZERO {
        add(format!("{:?}", scene.sky_gradient).as_bytes());
    }
    add(format!("{:?} {:?}", scene.materials, scene.lights).as_bytes());
    for mesh in &scene.meshes {
        add(&mesh.material.to_le_bytes());
        add(cast_slice(&mesh.positions));
        add(cast_slice(&mesh.normals));
        add(cast_slice(&mesh.tangents));
        mesh.uvs.iter().for_each(|uvs| add(cast_slice(uvs)));
        add(cast_slice(&mesh.colors));
        add(cast_slice(&mesh.indices));
    }
    for image in &scene.images {
        add(&image.width.to_le_bytes());
        add(&image.rgba);
    }
    hasher.finalize()
}

/// Little-endian: magic, key, size, history, rows, then a hash of all these bytes.
fn encode(film: &Film, key: &blake3::Hash) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(MAGIC);
    bytes.extend(key.as_bytes());
    bytes.extend(film.width.to_le_bytes());
    bytes.extend((film.rows.len() as u32).to_le_bytes());
    bytes.extend((film.history.len() as u32).to_le_bytes());
    for (samples, noise) in &film.history {
        bytes.extend(samples.to_le_bytes());
        bytes.extend(noise.to_le_bytes());
    }
    for row in &film.rows {
        bytes.extend(row.done.to_le_bytes());
        bytes.extend(row.rejected.to_le_bytes());
        bytes.extend(cast_slice::<Pixel, u8>(&row.pixels));
    }
    bytes.extend(blake3::hash(&bytes).as_bytes());
    bytes
}

/// The film in a file; `None` if the file is missing, damaged or of another key.
fn load(path: &Path, key: &blake3::Hash, options: &Options) -> Option<Film> {
    let bytes = std::fs::read(path).ok()?;
    let (content, hash) = bytes.split_last_chunk::<32>()?;
    let mut rest = (blake3::hash(content).as_bytes() == hash).then_some(content)?;
    let head = (take(&mut rest)?, take(&mut rest)?, take(&mut rest)?);
    let matches = head == (MAGIC, *key.as_bytes(), [options.width, options.height]);
    let mut film = matches.then(|| Film::new(options.width, options.height))?;
    for _ in 0..take::<u32>(&mut rest)? {
        film.history.push((take(&mut rest)?, take(&mut rest)?));
    }
    for row in &mut film.rows {
        (row.done, row.rejected) = (take(&mut rest)?, take(&mut rest)?);
        for pixel in &mut row.pixels {
            *pixel = take(&mut rest)?;
        }
    }
    rest.is_empty().then_some(film)
}

fn take<T: AnyBitPattern>(rest: &mut &[u8]) -> Option<T> {
    let (here, after) = rest.split_at_checked(size_of::<T>())?;
    *rest = after;
    Some(pod_read_unaligned(here))
}
