//! A cache of references between runs: films, stored under a hash of everything that determines their samples.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use bytemuck::{AnyBitPattern, cast_slice, pod_read_unaligned};

use super::film::{Film, Pixel};
use super::tile::Tiles;
use super::{Control, Depth, Options, Progress, VERSION, render};
use crate::Result;
use crate::folders;
use crate::output::file;
use crate::scene::{Pose, Still};

/// The first bytes of a film's file; the last one is the version of the format.
const MAGIC: [u8; 8] = *b"2bfilm\0\x03";

/// The interval of saving. A crash loses at most this much work.
const SAVE_EVERY: Duration = Duration::from_secs(30);

/// Maximum bytes of kept films. Least recently used films are deleted first.
const MOST_BYTES: u64 = 4 << 30;
/// The maximum samples per pixel of a valid film: larger counts exceed their type and would take years.
const MOST_SAMPLES: u32 = 1 << 30;

/// A folder of films, or no folder.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: Option<PathBuf>,
}

impl Cache {
    /// The folder of the user: `TWOBOUNCE_CACHE`, else that of [`folders::cache`].
    pub fn of_user() -> Self {
        let chosen = std::env::var_os("TWOBOUNCE_CACHE").filter(|value| !value.is_empty()).map(PathBuf::from);
        Self { folder: chosen.or_else(folders::cache) }
    }

    /// A cache that keeps nothing.
    pub fn none() -> Self {
        Self { folder: None }
    }

    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self { folder: Some(folder.into()) }
    }

    /// The folder of films; `None` if nothing is kept.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref().filter(|_| self.problem().is_none())
    }

    /// The reason why films cannot be kept, if there is one.
    pub fn problem(&self) -> Option<String> {
        let Some(folder) = &self.folder else { return Some("no folder is known for the cache of references".into()) };
        file::create_folder(folder)
            .and_then(|()| file::check_writable(&folder.join("new.film")))
            .err()
            .map(|e| e.to_string())
    }

    /// The finished film for `options`: from the cache, or rendered starting from the state in the cache. After
    /// `cancel` is set, the finished part is saved and the result is [`crate::Error::Interrupted`]. A failure to save
    /// only costs time in the next run.
    pub fn render(
        &self,
        of: Still,
        options: &Options,
        progress: &(dyn Fn(Progress) + Sync),
        cancel: &AtomicBool,
    ) -> Result<Film> {
        let key = key(of, options);
        let part =
            Some(options.stop.first()).filter(|first| *first > 0).map_or(String::new(), |first| format!("-{first}"));
        let mut path = match (&self.folder, self.problem()) {
            (Some(folder), None) => Some(folder.join(format!("{}{part}.film", key.to_hex()))),
            _ => None,
        };
        // If another process renders the same film, this one waits for it. Without support for file locks it does not.
        let _lock = path.as_ref().and_then(|path| {
            loop {
                match file::FileLock::take(&path.with_extension("lock")) {
                    Ok(None) if !cancel.load(Ordering::Relaxed) => std::thread::sleep(Duration::from_millis(50)),
                    taken => break taken.ok().flatten(),
                }
            }
        });
        let kept = path.as_ref().and_then(|path| load(path, &key, options));
        let mut film = match kept {
            Some(film) if !options.stop.passed(&film) => film,
            _ => Film::new(options.width, options.height),
        };
        let (mut saved, mut saved_paths) = (Instant::now(), film.paths());
        let mut save = |film: &Film| {
            let due = options.stop.reached(film) || cancel.load(Ordering::Relaxed) || saved.elapsed() > SAVE_EVERY;
            let Some(to) = path.as_ref().filter(|_| due && film.paths() > saved_paths) else { return Ok(()) };
            let _writing = file::writing();
            match file::write(to, &encode(film, &key)) {
                Ok(()) => file::make_room(to, MOST_BYTES),
                Err(error) => {
                    tracing::warn!("the reference is not kept: {error}");
                    path = None;
                }
            }
            (saved, saved_paths) = (Instant::now(), film.paths());
            Ok(())
        };
        render(of, options, &mut film, Control { progress, save: &mut save, cancel })?;
        Ok(film)
    }
}

/// A hash of everything that determines the samples. [`Options::stop`] is left out, because it does not change a
/// sample.
pub fn key(Still { scene, pose, view }: Still, options: &Options) -> blake3::Hash {
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
    // Debug prints floats with enough digits to distinguish them. Deformations are included by the vertices.
    let Pose { world_from_instance, lights, world_from_camera, .. } = pose;
    let pose_words = format!(
        "Pose {{ world_from_instance: {world_from_instance:?}, lights: {lights:?}, world_from_camera: {world_from_camera:?} }}"
    );
    add(format!("{view:?} {pose_words} {:?} {:?} {:?}", scene.sky, scene.instances, scene.textures).as_bytes());
    if scene.sky_gradient != glam::Vec3::ZERO {
        add(format!("{:?}", scene.sky_gradient).as_bytes());
    }
    if scene.sky_unseen {
        add(b"sky unseen");
    }
    if let Some(map) = &scene.sky_map {
        add(format!("{} {:?}", map.hash, scene.sky_turn).as_bytes());
    }
    add(format!("{:?} {:?}", scene.materials, scene.lights).as_bytes());
    for mesh in &scene.posed_meshes(pose) {
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

/// Little-endian: magic, key, size, first sample, history, rows, then a hash of all these bytes.
pub(super) fn encode(film: &Film, key: &blake3::Hash) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(MAGIC);
    bytes.extend(key.as_bytes());
    bytes.extend(film.width.to_le_bytes());
    bytes.extend((film.rows.len() as u32).to_le_bytes());
    bytes.extend(film.first.to_le_bytes());
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
    let (film, of) = decode(&std::fs::read(path).ok()?)?;
    let wanted = (key, options.width, options.height as usize, options.stop.first());
    let film = ((&of, film.width, film.rows.len(), film.first) == wanted).then_some(film)?;
    // The time of the last use determines how long the file is kept.
    let _ = File::options().write(true).open(path).and_then(|file| file.set_modified(SystemTime::now()));
    Some(film)
}

/// The film that [`encode`] wrote, and its key; `None` if it is damaged.
pub(super) fn decode(bytes: &[u8]) -> Option<(Film, blake3::Hash)> {
    let (content, hash) = bytes.split_last_chunk::<32>()?;
    let mut rest = (blake3::hash(content).as_bytes() == hash).then_some(content)?;
    let (magic, key) = (take::<[u8; 8]>(&mut rest)?, take::<[u8; 32]>(&mut rest)?);
    let [width, height, first, history] = take::<[u32; 4]>(&mut rest)?;
    // Each row holds its counts and its pixels. Memory is only allocated for data that the file has.
    let row_bytes = 12 + u64::from(width) * size_of::<Pixel>() as u64;
    let needed = 12u64.checked_mul(history.into())?.checked_add(row_bytes.checked_mul(height.into())?)?;
    if magic != MAGIC || needed != rest.len() as u64 || width == 0 || height == 0 {
        return None;
    }
    let mut film = Film { first, ..Film::new(width, height) };
    for _ in 0..history {
        film.history.push((take(&mut rest)?, take(&mut rest)?));
    }
    for row in &mut film.rows {
        (row.done, row.rejected) = (take(&mut rest)?, take(&mut rest)?);
        for pixel in &mut row.pixels {
            *pixel = take(&mut rest)?;
        }
    }
    // Noise is only recorded for existing samples, and the rows of a tile are traced together.
    let last = film.history.last().map_or(0, |(samples, _)| *samples);
    let is_believed = film.started() <= MOST_SAMPLES
        && first <= MOST_SAMPLES
        && last <= film.done()
        && Tiles::from_tile(first + film.done()).are_even(&film.rows);
    is_believed.then_some((film, blake3::Hash::from_bytes(key)))
}

fn take<T: AnyBitPattern>(rest: &mut &[u8]) -> Option<T> {
    let (here, after) = rest.split_at_checked(size_of::<T>())?;
    *rest = after;
    Some(pod_read_unaligned(here))
}
