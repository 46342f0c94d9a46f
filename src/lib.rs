//! Global illumination for glTF 2.0 scenes in raw Vulkan, with or without a GPU. A Vulkan program lends its device and
//! has frames recorded into its own command buffers. Other programs have images rendered on a device that is opened
//! here.
//!
//! Lamps, lights and the sky cast exact shadows. Indirect light of two bounces or of all is computed by one of several
//! methods ([`settings::Method`]). The repository's README shows the time of each and its error against a path-traced
//! reference. Equal calls on the same device give equal bits.
//!
//! # A picture
//!
//! [`render`] does what the command `twobounce render` does by default: it frames a scene that has no camera, lights
//! one that has no light as a studio does, and refines the picture until its noise is low. [`Options`] changes each of
//! these.
//!
//! ```
//! use twobounce::{Options, Scene, render};
//!
//! let scene = Scene::open("assets/cornell-point.glb")?;
//! let mut options = Options::preset("fast")?;
//! options.size = (320, 240);
//! # options.size = (48, 36);
//! # options.set("voxels=16")?;
//! # options.validation = true;
//! let image = render(&scene, &options)?;
//! image.notes.iter().for_each(|note| eprintln!("{note}"));
//! let path = std::env::temp_dir().join("cornell.png");
//! image.save(&path)?; // exposed and tone-mapped; an .exr has the radiance itself
//! let radiance: &[[f32; 3]] = image.radiance();
//! # assert_eq!(radiance.len(), 48 * 36);
//! # assert!(radiance.iter().flatten().sum::<f32>() > 0.0);
//! # std::fs::remove_file(path).unwrap();
//! # Ok::<(), twobounce::Error>(())
//! ```
//!
//! A program that renders many images of one scene keeps a [`renderer::Renderer`] and renders a pose and a view with
//! each call.
//!
//! # In a Vulkan program
//!
//! The whole contract is in [`host`]. In short, a program enables the features and extensions of
//! [`host::required_features`] and [`host::required_extensions`], lends its device once, prepares a scene once, and
//! then records frames. Recording allocates, submits and waits for nothing. Radiance goes to an image of the program,
//! and depth, normals and albedo are available as images. A program can also draw surfaces itself and hand over their
//! depth, normals and albedo to have them lit.
//!
//! ```no_run
//! use std::path::Path;
//! use std::sync::Arc;
//! use twobounce::ash::vk;
//! use twobounce::host::{Aov, Context, HostDevice, HostImage, Prepare, Prepared, Shot};
//! use twobounce::scene::{LoadOptions, Scene, View};
//! use twobounce::settings::Settings;
//!
//! /// Once: `lent` says what the program's device is and what is enabled on it.
//! fn prepare(lent: HostDevice<'_>, scene: &Scene) -> twobounce::Result<Prepared> {
//!     // SAFETY: the handles are valid and outlive what is prepared.
//!     let context: Arc<Context> = unsafe { Context::adopt(lent)? };
//!     let pose = scene.pose(None, 0.0);
//!     let mut settings = Settings::fast();
//!     settings.set("voxels=64")?;
//!     Prepared::new(&context, scene, &pose, &settings, &Prepare::new((1280, 720), scene.bounds(None)))
//! }
//!
//! /// Each frame, once the device is done with the one before in the same slot; `target` says where radiance goes.
//! fn frame(
//!     prepared: &mut Prepared,
//!     (scene, view): (&Scene, &View),
//!     (commands, slot): (vk::CommandBuffer, usize),
//!     target: HostImage,
//! ) -> twobounce::Result<()> {
//!     // SAFETY: the device is done with the slot.
//!     if let Some(growth) = unsafe { prepared.poll(slot) } {
//!         // The program waits for all frames in flight, and then:
//!         // SAFETY: none is in flight.
//!         unsafe { prepared.grow(growth)? };
//!     }
//!     let output = prepared.output(Aov::Beauty, target)?;
//!     let pose = scene.pose(None, 0.5);
//!     // SAFETY: the buffer is recording, outside of a rendering scope, and the slot is free.
//!     unsafe { prepared.record(commands, slot, &Shot::new(scene, &pose, view), &[output]) };
//!     Ok(())
//! }
//!
//! let scene = Scene::load(Path::new("scene.glb"), &LoadOptions::default())?;
//! # Ok::<(), twobounce::Error>(())
//! ```
//!
//! `examples/host/` is a complete program of this kind: `cargo run --release --example host -- scene.glb image.png`.
//!
//! # Stability of the API
//!
//! Versions follow [semantic versioning](https://semver.org) for the items of these pages: [`render`], [`host`],
//! [`renderer`], [`scene`], [`settings`], [`Error`], and the crates whose types a host passes, [`ash`], [`glam`] and
//! [`gpu_allocator`]. Programs create structs by their functions and then change fields, or use `..`, because versions
//! may add fields. All other public items serve the program `twobounce` and the tests. They are hidden here and may
//! change with any version (`RUSTDOCFLAGS="--cfg internals" cargo doc` shows them).

pub mod host;
pub mod renderer;
pub mod scene;
pub mod settings;

// These modules are not for hosts: see the first page above.
#[cfg_attr(not(internals), doc(hidden))]
pub mod assets;
#[cfg_attr(not(internals), doc(hidden))]
pub mod chart;
#[cfg_attr(not(internals), doc(hidden))]
pub mod color;
#[cfg_attr(not(internals), doc(hidden))]
pub mod error;
#[cfg_attr(not(internals), doc(hidden))]
pub mod folders;
#[cfg_attr(not(internals), doc(hidden))]
pub mod frame;
#[cfg_attr(not(internals), doc(hidden))]
pub mod gi;
#[cfg_attr(not(internals), doc(hidden))]
pub mod ground;
#[cfg_attr(not(internals), doc(hidden))]
pub mod lab;
#[cfg_attr(not(internals), doc(hidden))]
pub mod layers;
#[cfg_attr(not(internals), doc(hidden))]
pub mod measure;
#[cfg_attr(not(internals), doc(hidden))]
pub mod memory;
#[cfg_attr(not(internals), doc(hidden))]
pub mod output;
#[cfg_attr(not(internals), doc(hidden))]
pub mod plan;
#[cfg_attr(not(internals), doc(hidden))]
pub mod profile;
#[cfg_attr(not(internals), doc(hidden))]
pub mod reference;
#[cfg_attr(not(internals), doc(hidden))]
pub mod stability;
#[cfg_attr(not(internals), doc(hidden))]
pub mod stage;
#[cfg_attr(not(internals), doc(hidden))]
pub mod vk;

/// The crates whose types a host passes.
pub use {ash, glam, gpu_allocator};

pub use error::{Error, Result};
pub use layers::Aov;
pub use scene::Scene;
pub use stage::{Image, Noise, Options, PathTracing, Progress, Sky, Stage, Viewpoint, When, path_trace, render};
