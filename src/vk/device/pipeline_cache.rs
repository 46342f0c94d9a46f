//! The driver's compiled pipelines, kept on disk from run to run, one file per device and driver.

use super::needs::Capabilities;
use crate::folders;
use ash::vk;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Bytes of the checksum before the data in the file, because drivers trust the data.
const HASH_BYTES: usize = 32;

pub(in crate::vk) struct PipelineCache {
    /// Null if the driver could not create one; pipelines are then compiled without a cache.
    pub(in crate::vk) handle: vk::PipelineCache,
    file: Option<PathBuf>,
    loaded: Vec<u8>,
    /// Whether the cache was created here, not by a host.
    own: bool,
}

impl PipelineCache {
    pub(in crate::vk) fn open(device: &ash::Device, capabilities: &Capabilities) -> Self {
        let file = folders::cache().map(|folder| folder.join(file_name(capabilities)));
        let loaded = file.as_deref().and_then(read).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&loaded);
        // SAFETY: the checksum proves that the same driver wrote the data.
        let handle = unsafe { device.create_pipeline_cache(&info, None) }.unwrap_or_default();
        Self { handle, file, loaded, own: true }
    }

    /// A host's cache, or null. Nothing is read, written or destroyed.
    pub(in crate::vk) fn of_host(handle: vk::PipelineCache) -> Self {
        Self { handle, file: None, loaded: Vec::new(), own: false }
    }

    /// Whether no earlier run left a pipeline.
    pub(in crate::vk) fn is_cold(&self) -> bool {
        self.own && self.loaded.is_empty()
    }

    /// Writes new data and destroys the cache. A failure to write is only logged.
    pub(in crate::vk) unsafe fn close(&self, device: &ash::Device) {
        if !self.own {
            return;
        }
        // SAFETY: the caller's: the device is alive and no pipeline is being made. Destroying null is allowed.
        unsafe {
            if self.handle != vk::PipelineCache::null()
                && let (Some(file), Ok(data)) = (&self.file, device.get_pipeline_cache_data(self.handle))
                && data != self.loaded
                && let Err(error) = write(file, &data)
            {
                tracing::warn!("{}: the pipeline cache was not written: {error}", file.display());
            }
            device.destroy_pipeline_cache(self.handle, None);
        }
    }
}

fn file_name(capabilities: &Capabilities) -> String {
    let properties = &capabilities.properties;
    let mut hash = blake3::Hasher::new();
    for part in [properties.vendor_id, properties.device_id, properties.driver_version, properties.api_version] {
        hash.update(&part.to_le_bytes());
    }
    hash.update(&properties.pipeline_cache_uuid);
    hash.update(capabilities.name().as_bytes());
    hash.update(capabilities.driver.as_bytes());
    format!("pipelines-{}.bin", &hash.finalize().to_hex()[..16])
}

/// The data of a complete, undamaged file.
fn read(file: &Path) -> Option<Vec<u8>> {
    let bytes = fs::read(file).ok()?;
    let (hash, data) = bytes.split_at_checked(HASH_BYTES)?;
    (blake3::hash(data).as_bytes() == hash).then(|| data.to_vec())
}

/// Writes a temporary file first and renames it, so that a reader sees either the old file or the new one.
fn write(file: &Path, data: &[u8]) -> io::Result<()> {
    let folder = file.parent().ok_or(io::ErrorKind::InvalidInput)?;
    fs::create_dir_all(folder)?;
    let beside = file.with_extension(format!("{}.tmp", std::process::id()));
    let mut bytes = blake3::hash(data).as_bytes().to_vec();
    bytes.extend_from_slice(data);
    let result = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, file));
    if result.is_err() {
        // The temporary file may not exist.
        let _ = fs::remove_file(&beside);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cache_file_survives_only_undamaged() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("sub").join("pipelines.bin");
        assert_eq!(read(&file), None);
        write(&file, b"compiled").unwrap();
        assert_eq!(read(&file).as_deref(), Some(&b"compiled"[..]));
        assert_eq!(fs::read_dir(file.parent().unwrap()).unwrap().count(), 1, "nothing is left beside it");
        let mut bytes = fs::read(&file).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(&file, &bytes).unwrap();
        assert_eq!(read(&file), None);
        fs::write(&file, &bytes[..HASH_BYTES - 1]).unwrap();
        assert_eq!(read(&file), None);
    }
}
