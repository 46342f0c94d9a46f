//! Equirectangular maps and images of other programs: every kind of Radiance's headers and of OpenEXR's channels gives
//! the radiance that it states. `make.py` made the files, with OpenEXR's own library.

use exr::math::Vec2;
use exr::meta::attribute::Chromaticities;
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Layers as Parts};
use exr::prelude::{ImageAttributes, WritableImage};
use glam::Vec3;
use tempfile::TempDir;
use twobounce::layers::Layers;
use twobounce::output::exr as output;
use twobounce::scene::sky;

const ABOVE: Vec3 = Vec3::new(1.0, 0.5, 0.25);
const BELOW: Vec3 = Vec3::new(0.25, 0.5, 1.0);

/// The notes, and the radiance of a map's rows, each of which is uniform.
fn rows(header: &str, size: &str, texels: &[[u8; 4]]) -> Result<(Vec<Vec<Vec3>>, Vec<String>), String> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("map.hdr");
    let bytes = [format!("{header}\n{size}\n").as_bytes(), texels.as_flattened()].concat();
    std::fs::write(&path, bytes).unwrap();
    let (map, notes) = sky::read(&path, None).map_err(|e| e.to_string())?;
    Ok((map.radiance.chunks(map.width).map(<[Vec3]>::to_vec).collect(), notes))
}

/// Three mantissas and an exponent above 128 of [`ABOVE`] and of [`BELOW`].
const STORED: [[u8; 4]; 2] = [[128, 64, 32, 129], [32, 64, 128, 129]];

/// A map of four by two texels, stored by rows from the top.
fn by_rows(header: &str) -> Result<(Vec<Vec<Vec3>>, Vec<String>), String> {
    rows(header, "-Y 2 +X 4", &[[STORED[0]; 4], [STORED[1]; 4]].concat())
}

#[test]
fn every_header_of_radiance_gives_the_radiance_that_it_means() {
    let shown = |scale: Vec3| vec![vec![ABOVE * scale; 4], vec![BELOW * scale; 4]];
    for (header, scale) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", Vec3::ONE),
        ("#?RGBE\nFORMAT=32-bit_rle_rgbe\n", Vec3::ONE),
        ("#?AUTOPANO11\nFORMAT = 32-bit_rle_rgbe\n", Vec3::ONE),
        ("#?RADIANCE\n", Vec3::ONE),
        ("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r", Vec3::ONE),
        ("#?RADIANCE\nEXPOSURE=2.0\n", Vec3::splat(0.5)),
        ("#?RADIANCE\nEXPOSURE=2\nVIEW=-vtv\nexposure= 4\n", Vec3::splat(0.125)),
        ("#?RADIANCE\nCOLORCORR=1 2 4\n", Vec3::new(1.0, 0.5, 0.25)),
        ("#?RADIANCE\nCOLORCORR=1 2 4\nCOLORCORR=2 2 2\nEXPOSURE=0.5\n", Vec3::new(1.0, 0.5, 0.25)),
        ("#?RADIANCE\n# EXPOSURE=2\nSOFTWARE=x=y\nGAMMA=1\nPIXASPECT=1\n", Vec3::ONE),
        ("#?RADIANCE\nPRIMARIES= 0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n", Vec3::ONE),
    ] {
        let (rows, notes) = by_rows(header).unwrap();
        assert_eq!((rows, notes), (shown(scale), vec![]), "{header}");
    }
    for odd in ["EXPOSURE=0", "EXPOSURE=bright", "COLORCORR=1 2", "GAMMA=2.2", "PRIMARIES=0 0 0 0 0 0 0 0"] {
        let (rows, notes) = by_rows(&format!("#?RADIANCE\n{odd}\n")).unwrap();
        assert_eq!((rows, notes), (shown(Vec3::ONE), vec![format!("map.hdr: {odd} in its header was ignored")]));
    }
}

/// A grey of the file's own white is grey in Rec. 709, with its luminance in the file.
#[test]
fn other_primaries_of_radiance_become_rec_709() {
    let grey = [[64, 64, 64, 129]; 8];
    for header in
        ["#?RADIANCE\nPRIMARIES=.708 .292 .17 .797 .131 .046 .3333 .3333\n", "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n"]
    {
        let (rows, notes) = rows(header, "-Y 2 +X 4", &grey).unwrap();
        assert!(
            rows.iter().flatten().all(|c| (*c - Vec3::splat(0.5)).abs().max_element() < 1e-4),
            "{header}: {rows:?}"
        );
        assert_eq!(notes.len(), 0, "{notes:?}");
    }
    // Rec. 2020's green, by ITU-R BT.2087; negative values become 0, with a note.
    let green = [[0, 128, 0, 129]; 8];
    let (rows, notes) =
        rows("#?RADIANCE\nPRIMARIES=.708 .292 .17 .797 .131 .046 .3127 .329\n", "-Y 2 +X 4", &green).unwrap();
    assert!(
        (rows[0][0] - Vec3::new(0.0, 1.1329, 0.0)).abs().max_element() < 1e-3 && notes.len() == 1,
        "{rows:?} {notes:?}"
    );
}

#[test]
fn texels_of_every_order_are_put_in_place() {
    // Column x of row y has the red x + 4 y.
    let texel = |x: usize, y: usize| [16 * (x + 4 * y) as u8, 0, 128, 129];
    for (size, place) in [
        ("-Y 2 +X 4", (|line, at| (at, line)) as fn(usize, usize) -> (usize, usize)),
        ("-Y 2 -X 4", |line, at| (3 - at, line)),
        ("+Y 2 +X 4", |line, at| (at, 1 - line)),
        ("+Y 2 -X 4", |line, at| (3 - at, 1 - line)),
        ("+X 4 -Y 2", |line, at| (line, at)),
        ("+X 4 +Y 2", |line, at| (line, 1 - at)),
        ("-X 4 -Y 2", |line, at| (3 - line, at)),
        ("-X 4 +Y 2", |line, at| (3 - line, 1 - at)),
    ] {
        let length = if size.contains("Y 2 ") { 4 } else { 2 };
        let stored: Vec<[u8; 4]> = (0..8).map(|i| place(i / length, i % length)).map(|(x, y)| texel(x, y)).collect();
        let (rows, _) = rows("#?RADIANCE\n", size, &stored).unwrap();
        let red: Vec<f32> = rows.concat().iter().map(|c| 8.0 * c.x).collect();
        assert_eq!((rows.len(), red), (2, (0..8).map(|i| i as f32).collect()), "{size}");
    }
}

#[test]
fn odd_headers_of_radiance_are_refused_in_a_sentence() {
    for (header, size, part) in [
        ("RADIANCE\n", "-Y 2 +X 4", "does not begin with #?RADIANCE or #?RGBE"),
        ("#?RADIANCE\nFORMAT=16-bit\n", "-Y 2 +X 4", "it has the format \"16-bit\""),
        ("#?RADIANCE\n", "-Y 2 +Y 4", "\"-Y 2 +Y 4\" is no size and order of texels"),
        ("#?RADIANCE\n", "-Y 0 +X 4", "has no texels"),
        ("#?RADIANCE\n", "+X 99999 -Y 2", "has more than 16384 texels a side"),
        ("#?RADIANCE\n", "-Y 16384 +X 16384", "too short"),
        ("#?RADIANCE\n", "-Y 2 +X 5", "is not a readable Radiance image"),
    ] {
        let refusal = rows(header, size, &[STORED[0]; 8]).unwrap_err();
        assert!(refusal.contains("map.hdr") && refusal.contains(part), "{part}: {refusal}");
    }
}

/// The files' luminance and chroma, as in `make.py`: chroma is linear, so that values between its samples are known.
fn expected(x: usize, y: usize, sampling: usize) -> Vec3 {
    let luminance = 0.5 + 0.25 * x as f32 + 0.125 * (y % 3) as f32;
    // There is no sample after the last one.
    let (x, y) = (x.min(12 - sampling) as f32, y.min(40 - sampling) as f32);
    let (ry, by) = (0.0625 * x - 0.03125 * y, 0.03125 * y - 0.0625 * x);
    let (r, b) = ((ry + 1.0) * luminance, (by + 1.0) * luminance);
    Vec3::new(r, (luminance - 0.2126 * r - 0.0722 * b) / 0.7152, b)
}

#[test]
fn luminance_and_chroma_of_openexr_are_colours() {
    let check = |bytes: &[u8], sampling: usize, name: &str| {
        let (layers, _) = output::decode(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((layers.width, layers.height, layers.layers.len()), (12, 40, 1), "{name}");
        for (i, pixel) in layers.beauty().iter().enumerate() {
            let right = expected(i % 12, i / 12, sampling);
            assert!(
                (Vec3::from(*pixel) - right).abs().max_element() < 0.01,
                "{name}, pixel {i}: {pixel:?} is not {right}"
            );
        }
    };
    check(include_bytes!("chroma-full.exr"), 1, "full");
    check(include_bytes!("chroma-no.exr"), 2, "none");
    check(include_bytes!("chroma-rle.exr"), 2, "rle");
    check(include_bytes!("chroma-zips.exr"), 2, "zips");
    check(include_bytes!("chroma-zip.exr"), 2, "zip");
    check(include_bytes!("chroma-piz.exr"), 2, "piz");
    check(include_bytes!("chroma-piz-float.exr"), 2, "piz, float");
    check(include_bytes!("chroma-pxr24.exr"), 2, "pxr24");
    check(include_bytes!("chroma-dwaa.exr"), 2, "dwaa");
    let refusal = output::decode(include_bytes!("chroma-b44.exr")).unwrap_err();
    assert!(refusal.contains("of fewer samples than pixels"), "{refusal}");
}

/// A part of two by one pixels with these channels.
fn part(name: &str, channels: &[(&str, [f32; 2])]) -> Layer<AnyChannels<FlatSamples>> {
    let channel = |(name, samples): &(&str, [f32; 2])| AnyChannel::new(*name, FlatSamples::F32(samples.to_vec()));
    let channels = AnyChannels::sort(channels.iter().map(channel).collect());
    Layer::new((2, 1), LayerAttributes::named(name), Encoding::UNCOMPRESSED, channels)
}

/// The image of a file of these parts, with these primaries.
fn image(parts: Vec<Layer<AnyChannels<FlatSamples>>>, chromaticities: Option<[[f32; 2]; 4]>) -> Result<Layers, String> {
    let mut attributes = ImageAttributes::with_size((2, 1));
    let point = |[x, y]: [f32; 2]| Vec2(x, y);
    attributes.chromaticities = chromaticities.map(|[red, green, blue, white]| Chromaticities {
        red: point(red),
        green: point(green),
        blue: point(blue),
        white: point(white),
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image { attributes, layer_data: Parts::from(parts) }.write().to_buffered(&mut bytes).unwrap();
    output::decode(&bytes.into_inner()).map(|(layers, _)| layers)
}

#[test]
fn the_first_part_with_colours_is_the_image() {
    let colors = [("R", [1.0, 2.0]), ("G", [3.0, 4.0]), ("B", [5.0, 6.0])];
    let depth = || part("depth", &[("Z", [9.0; 2])]);
    let grey = || part("mask", &[("Y", [7.0, 8.0])]);
    let pixels = vec![[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]];
    let shown = |parts| image(parts, None).unwrap().beauty().to_vec();
    assert_eq!(shown(vec![depth(), part("rgba", &colors)]), pixels);
    assert_eq!(
        shown(vec![depth(), grey(), part("rgba", &colors), part("other", &colors.map(|(n, _)| (n, [0.0; 2])))]),
        pixels
    );
    assert_eq!(shown(vec![depth(), grey()]), vec![[7.0; 3], [8.0; 3]]);
    let with_alpha = part("rgba", &[&colors[..], &[("A", [0.5; 2])]].concat());
    assert_eq!(image(vec![depth(), with_alpha], None).unwrap().layers.len(), 2);
    assert_eq!(image(vec![depth()], None).unwrap_err(), "has no channels R, G and B, and no Y");
}

#[test]
fn chromaticities_of_openexr_become_rec_709() {
    const REC_709: [[f32; 2]; 4] = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]];
    const REC_2020: [[f32; 2]; 4] = [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046], [0.3127, 0.329]];
    let colors = || {
        part(
            "rgb",
            &[
                ("R", [1.0, 0.0]),
                ("G", [1.0, 1.0]),
                ("B", [1.0, 0.0]),
                ("normal.R", [0.0; 2]),
                ("normal.G", [1.0; 2]),
                ("normal.B", [0.0; 2]),
            ],
        )
    };
    let shown = |chromaticities| image(vec![colors()], chromaticities).unwrap();
    assert_eq!(shown(Some(REC_709)), shown(None));
    let converted = shown(Some(REC_2020));
    let [white, green] = [0, 1].map(|i| Vec3::from(converted.beauty()[i]));
    assert!((white - Vec3::ONE).abs().max_element() < 1e-5, "{white}");
    // ITU-R BT.2087.
    assert!((green - Vec3::new(-0.5876, 1.1329, -0.1006)).abs().max_element() < 1e-3, "{green}");
    assert_eq!(converted.layers[1].1, shown(None).layers[1].1, "directions are no colours");
    // Luminance is a sum of these primaries.
    let chroma =
        image(vec![part("yc", &[("Y", [0.5; 2]), ("RY", [0.0; 2]), ("BY", [0.0; 2])])], Some(REC_2020)).unwrap();
    assert!((Vec3::from(chroma.beauty()[0]) - Vec3::splat(0.5)).abs().max_element() < 1e-5);
    assert_eq!(shown(Some([[0.0; 2]; 4])), shown(None), "what is no colour space is taken as Rec. 709");
}
