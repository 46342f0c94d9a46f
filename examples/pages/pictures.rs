//! The pictures of `docs/notes/talk.md`: a host records a frame that stops after the lists, and a whole frame, to show
//! their buffers and volumes.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use half::f16;
use image::{ImageFormat, Rgb, RgbImage};
use twobounce::frame::{Frame, FrameDesc, Shot};
use twobounce::ground::image::target::{self, Readback};
use twobounce::ground::layout::{Globals, ListItem, Triangle};
use twobounce::ground::scene_on_gpu::ScenePacked;
use twobounce::ground::volume::LightVolume;
use twobounce::layers::Aov;
use twobounce::output::display::{Display, ToneMap};
use twobounce::scene::{LoadOptions, Pose, Scene};
use twobounce::settings::{Bounces, Settings};
use twobounce::vk::{Context, ContextOptions, Recorder, RecorderOptions, download, download_image};
use twobounce::{Error, Result};

/// The edge of the slides' volume in voxels.
const EDGE: u32 = 128;
/// Pixels of an image on the page, a side.
pub const IMAGE_SIZE: u32 = 512;
/// Pixels of a slice of the volume, a side.
const TILE: u32 = 256;
/// Pixels between tiles.
const GAP: u32 = 4;
/// The slice of the volume in the pictures, from above: voxels with this y, a little over the floor.
const SLICE: u32 = 36;
/// Exposure of slices above that of the image, EV: most voxels receive no light.
const BRIGHTER: f32 = 2.0;
const AOVS: &[Aov] = &[Aov::Direct, Aov::Indirect];

/// A picture's file in `docs/notes/talk/`, and the bytes of the PNG.
pub type Named = (&'static str, Vec<u8>);

/// The page's scene.
pub fn gallery() -> Result<Scene> {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/gallery.glb"), &LoadOptions::default())
}

/// The presets with a column of times and an image of their own.
pub fn presets() -> [(&'static str, Settings); 3] {
    let at_edge = |settings: Settings| Settings { voxels: EDGE, ..settings };
    [
        ("printed", at_edge(Settings::printed())),
        ("corrected", at_edge(Settings::corrected())),
        ("corrected-16", at_edge(Settings::corrected_16())),
    ]
}

/// Every picture of the page, images with `size` pixels a side; and the images' exposure in EV.
pub fn rendered(size: u32) -> Result<(Vec<Named>, f32)> {
    let scene = gallery()?;
    let pose = scene.pose(None, 0.0);
    let context = Context::new(&ContextOptions::default())?;
    let [(_, settings), corrected @ ..] = presets();
    let one = Settings { bounces: Bounces::One, ..settings.clone() };
    let (bounds, side, size, outputs) = (scene.bounds(None), size, (size, size), target::outputs(AOVS));
    let desc =
        |settings| FrameDesc { scene: &scene, settings, size, outputs, bounds, slots: 1, query: None, waits: false };
    let on_gpu = Arc::new(ScenePacked::new(&scene, &pose).upload(&context)?);
    let mut frame = Frame::new(&context, &desc(&settings), &on_gpu)?;

    make_lists(&context, &mut frame, &pose)?;
    let mut pictures = vec![("front-view.png", front_view(&context, &frame)?), ("lists.png", lists(&context, &frame)?)];

    let two_bounces = render(&context, &mut frame, &scene, &pose)?;
    let [beauty, direct, indirect] = [Aov::Beauty, Aov::Direct, Aov::Indirect].map(|layer| two_bounces.get(layer));
    let ev = ToneMap::default().automatic_exposure(two_bounces.beauty());
    let shown = |pixels: Option<&[[f32; 3]]>| {
        let pixels = pixels.unwrap_or_default();
        square(side, |x, y| exposed(Vec3::from(pixels[(y * side + x) as usize]), ev))
    };
    let [first, second] = frame.method.volumes() else {
        return Err(Error::Usage("two bounces are two volumes".into()));
    };
    let level = |volume, level, face| slice(&context, volume, (level, face), (frame.scale, ev + BRIGHTER));
    let faces = |volume| (0..7).map(|face| level(volume, 0, face)).collect::<Result<Vec<_>>>();
    pictures.push(("first-bounce.png", sheet(&faces(first)?, 4)));
    pictures.push(("second-bounce.png", sheet(&faces(second)?, 4)));
    let shrunk = [0, 3, 6].map(|face| (1..6).map(move |k| (k, face)));
    let mips = shrunk.into_iter().flatten().map(|(k, face)| level(first, k, face)).collect::<Result<Vec<_>>>();
    pictures.push(("mips.png", sheet(&mips?, 5)));

    let [(_, five), (_, sixteen)] = corrected;
    for (name, settings) in [("one-bounce.png", &one), ("corrected.png", &five), ("corrected-16.png", &sixteen)] {
        frame.change(&context, &desc(settings))?;
        make_lists(&context, &mut frame, &pose)?;
        let image = render(&context, &mut frame, &scene, &pose)?;
        pictures.push((name, sheet(&[shown(image.get(Aov::Beauty))], 1)));
    }
    pictures.push(("direct.png", sheet(&[shown(direct)], 1)));
    pictures.push(("indirect.png", sheet(&[shown(indirect)], 1)));
    pictures.push(("image.png", sheet(&[shown(beauty)], 1)));
    Ok((pictures, ev))
}

/// Only the passes up to the lists, until their buffers are large enough.
fn make_lists(context: &Arc<Context>, frame: &mut Frame, pose: &Pose) -> Result<()> {
    loop {
        let mut recorder = Recorder::new(context, RecorderOptions::default())?;
        frame.ground.record_lists(&mut recorder, pose);
        recorder.finish()?;
        let counters: Vec<Globals> = download(context, &frame.ground.base().globals)?;
        let counts = frame.counts().grown(&counters);
        if counts == *frame.counts() {
            return Ok(());
        }
        frame.grow(context, counts)?;
    }
}

fn render(context: &Arc<Context>, frame: &mut Frame, scene: &Scene, pose: &Pose) -> Result<twobounce::layers::Layers> {
    let readback = Readback::new(context, frame.target.size(), frame.target.shape().outputs)?;
    let mut recorder = Recorder::new(context, RecorderOptions::default())?;
    frame.record(&mut recorder, 0, &Shot { scene, pose, view: &scene.view(pose, 0), image: Some(0) });
    readback.record(&mut recorder, &frame.target);
    recorder.finish()?;
    Ok(readback.read(AOVS))
}

/// The recorded triangles seen from the volume's front, along −z, coloured by their normals, without those that face
/// away.
fn front_view(context: &Arc<Context>, frame: &Frame) -> Result<Vec<u8>> {
    let triangles: Vec<Triangle> = download(context, &frame.ground.triangles)?;
    let words: Vec<u32> = download(context, &frame.ground.attributes)?;
    let corner = frame.ground.scene.corner;
    let counters: Vec<Globals> = download(context, &frame.ground.base().globals)?;
    let mut seen = vec![(f32::NEG_INFINITY, Vec3::splat(-0.9)); (TILE * TILE) as usize];
    for (place, t) in triangles[..counters[0].vertex_count as usize / 3].iter().enumerate() {
        let [a, b, c] = t.corners.map(|v| Vec3::from(v) * (TILE / EDGE) as f32);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area <= 0.0 {
            continue;
        }
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let pixels = |low: f32, high: f32| low.max(0.0) as u32..(high.ceil() as u32).min(TILE);
        for (x, y) in pixels(min.y, max.y).flat_map(|y| pixels(min.x, max.x).map(move |x| (x, y))) {
            let p = Vec2::new(x as f32, y as f32) + 0.5;
            let part = |q: Vec3, r: Vec3| (q.truncate() - p).perp_dot(r.truncate() - p) / area;
            let weights = [part(b, c), part(c, a), part(a, b)];
            let depth = a.z * weights[0] + b.z * weights[1] + c.z * weights[2];
            let pixel = &mut seen[((TILE - 1 - y) * TILE + x) as usize];
            if weights.iter().all(|w| *w >= 0.0) && depth > pixel.0 {
                let normal = (0..3).map(|i| Vec3::from(corner.normal(&words, place, i)) * weights[i]).sum::<Vec3>();
                *pixel = (depth, normal);
            }
        }
    }
    let shown =
        tile(|x, y| (seen[(y * TILE + x) as usize].1 * 127.0 + 128.0).to_array().map(|v| v.clamp(0.0, 255.0) as u8));
    Ok(sheet(&[shown], 1))
}

/// The number of triangles in the lists of a slice's voxels.
fn lists(context: &Arc<Context>, frame: &Frame) -> Result<Vec<u8>> {
    let lists = frame.ground.base();
    let heads: Vec<u32> = download(context, &lists.heads)?;
    let items: Vec<ListItem> = download(context, &lists.items)?;
    let shown = tile(|x, y| {
        let (x, z) = (x * EDGE / TILE, y * EDGE / TILE);
        let next = |item: &u32| (*item != 0).then(|| items[*item as usize - 1].next);
        let first = heads[((z * EDGE + SLICE) * EDGE + x) as usize];
        let count = std::iter::successors(Some(first), next).filter(|item| *item != 0).count();
        match count {
            0 => [20, 20, 24],
            1 => [50, 90, 200],
            2 => [40, 170, 170],
            3..=4 => [90, 200, 90],
            5..=8 => [250, 220, 60],
            _ => [255; 3],
        }
    });
    Ok(sheet(&[shown], 1))
}

/// A level of one face, cut at [`SLICE`], every texel at its size in the world; empty texels are grey.
fn slice(
    context: &Arc<Context>,
    volume: &LightVolume,
    (level, face): (u32, usize),
    (scale, ev): (f32, f32),
) -> Result<RgbImage> {
    const EMPTY: f32 = 0.05;
    let texels: Vec<[u16; 4]> = download_image(context, &volume.images[face], level)?;
    let edge = volume.edge >> level;
    Ok(tile(|x, z| {
        let [x, y, z] = [x * EDGE / TILE, SLICE, z * EDGE / TILE].map(|at| at >> level);
        let [r, g, b, a] = texels[((z * edge + y) * edge + x) as usize].map(|bits| f16::from_bits(bits).to_f32());
        let behind = (1.0 - a).max(0.0) * EMPTY * (-ev).exp2();
        exposed(Vec3::new(r, g, b) / scale + behind, ev)
    }))
}

pub fn exposed(radiance: Vec3, ev: f32) -> [u8; 3] {
    Display { exposure_ev: ev, ..Display::default() }.codes(radiance.to_array())
}

/// A slice of the volume, rows from the top.
fn tile(pixel: impl Fn(u32, u32) -> [u8; 3]) -> RgbImage {
    square(TILE, pixel)
}

pub fn square(side: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> RgbImage {
    RgbImage::from_fn(side, side, |x, y| Rgb(pixel(x, y)))
}

/// Tiles in rows of `columns`, as a PNG.
pub fn sheet(tiles: &[RgbImage], columns: usize) -> Vec<u8> {
    let step = tiles[0].width() + GAP;
    let [width, height] = [columns, tiles.len().div_ceil(columns)].map(|count| count as u32 * step - GAP);
    let mut whole = RgbImage::from_pixel(width, height, Rgb([255; 3]));
    for (i, tile) in tiles.iter().enumerate() {
        let [x, y] = [i % columns, i / columns].map(|place| i64::from(step) * place as i64);
        image::imageops::replace(&mut whole, tile, x, y);
    }
    let mut bytes = Cursor::new(Vec::new());
    whole.write_to(&mut bytes, ImageFormat::Png).expect("memory takes every byte");
    bytes.into_inner()
}
