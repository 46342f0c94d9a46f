//! Explains why an image shows nothing, or almost nothing.

use crate::layers::{Aov, Layers};
use crate::output::display::{Display, MOST_BLACK, black_share};
use crate::scene::{Pose, Projection, Scene, Still, View};

/// An image is reported as white if more than this share of its pixels with a surface is white.
const MOST_WHITE: f64 = 0.99;
/// An image is reported as black if this share of all its pixels is black.
const MOST_BLACK_OF_ALL: f64 = 0.9;
/// 8-bit codes from this value count as white.
const WHITE: u8 = 253;

/// A sentence about an image that shows nothing or almost nothing. For an image for a display, `exposed` holds its tone
/// curve and exposure, and whether the exposure was chosen automatically.
pub fn why_blank(
    image: &Layers,
    Still { scene, pose, view }: Still,
    exposed: Option<(Display, bool)>,
) -> Option<String> {
    let surfaces: Vec<&[f32; 3]> = of_surfaces(image.beauty(), sky_shown(image, scene, view)).collect();
    if surfaces.is_empty() {
        return where_it_is(scene, pose, view).map(|why| format!("the image shows no surface: {why}"));
    }
    let (display, automatic) = exposed?;
    let is_white = |p: &&&[f32; 3]| display.codes(***p).into_iter().all(|code| code >= WHITE);
    let white = surfaces.iter().filter(is_white).count() as f64 / surfaces.len() as f64;
    let black = black_share(&surfaces, display);
    let (share, what) = match (black > MOST_BLACK, white > MOST_WHITE) {
        (true, _) => (black, "black"),
        (_, true) => (white, "white"),
        // Pixels without a surface are clear.
        _ if scene.sky_unseen => return None,
        _ => return mostly_black(image, display),
    };
    let (percent, ev) = ((100.0 * share).floor(), display.exposure_ev);
    Some(if automatic {
        format!(
            "{percent} % of the pixels that show a surface are {what} beside the brightest ones; try another --exposure than \
             {ev}, or light from a sky (--sky) or the default light (--default-light on)"
        )
    } else {
        format!(
            "{percent} % of the pixels that show a surface are {what} with --exposure {ev}; without it the exposure is chosen \
             automatically"
        )
    })
}

/// A sentence about an image that is black wherever no surface is, which is almost everywhere.
fn mostly_black(image: &Layers, display: Display) -> Option<String> {
    let share = black_share(&image.beauty().iter().collect::<Vec<_>>(), display);
    (share >= MOST_BLACK_OF_ALL).then(|| {
        let percent = (100.0 * share).floor();
        format!(
            "{percent} % of the image is black, most of it where no surface is; move the camera nearer, or give a --sky"
        )
    })
}

/// The pixels that differ from the radiance of the sky, which `sky` returns for each pixel.
fn of_surfaces(beauty: &[[f32; 3]], sky: impl Fn(usize) -> [f32; 3]) -> impl Iterator<Item = &[f32; 3]> {
    // The image stores the sky in half floats, with 11 significant bits.
    const HALF_FLOAT: f32 = 1.0 / 1024.0;
    let is_sky = move |i: usize, p: &[f32; 3]| p.iter().zip(sky(i)).all(|(a, b)| (a - b).abs() <= HALF_FLOAT * b);
    beauty.iter().enumerate().filter(move |(i, p)| !is_sky(*i, p)).map(|(_, p)| p)
}

/// The radiance of the sky at a pixel of `image`: the pixel's own value if no surface covers it. If a surface does, it
/// is the sky's radiance in that direction, or NaN for a map, which equals no pixel.
fn sky_shown<'a>(image: &'a Layers, scene: &'a Scene, view: &'a View) -> impl Fn(usize) -> [f32; 3] + 'a {
    let (alpha, size) = (image.get(Aov::Alpha).unwrap_or_default(), (image.width, image.height));
    move |pixel| match alpha.get(pixel) {
        Some([0.0, ..]) => image.beauty()[pixel],
        _ if scene.sky_map.is_some() => [f32::NAN; 3],
        _ => scene.sky_towards(view.direction(pixel, size)).into(),
    }
}

/// The reason why no surface covers any pixel; `None` if one may, but has exactly the sky's colour.
fn where_it_is(scene: &Scene, pose: &Pose, view: &View) -> Option<String> {
    if scene.triangle_count() == 0 {
        return Some("the file has no triangles, and points and lines are not drawn".into());
    }
    let (Projection::Perspective { near, far, .. } | Projection::Orthographic { near, far, .. }) = view.projection;
    let depths = scene.vertices(pose).map(|p| (p - view.eye).dot(view.forward));
    let (nearest, farthest) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), d| (a.min(d), b.max(d)));
    let moved = "move the camera, or choose one with --camera or --eye";
    Some(if farthest <= 0.0 {
        format!("the scene is behind the camera; {moved}")
    } else if farthest < f64::from(near) {
        format!("the scene ends {farthest:.3} m before the camera, nearer than its znear of {near} m; {moved}")
    } else if nearest > f64::from(far) {
        format!("the scene begins {nearest:.3} m before the camera, beyond its zfar of {far} m; {moved}")
    } else if scene.has_light() {
        format!("the scene is outside the camera's view, or shows it only the backs of single-sided surfaces; {moved}")
    } else {
        return None; // without light everything is black, which was reported before
    })
}
