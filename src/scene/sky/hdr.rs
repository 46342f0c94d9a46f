//! Reads Radiance's images, .hdr and .pic. The header is read here (Radiance's file formats: "Radiance Picture"), the
//! crate `image` decodes the scan lines.

use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use glam::{DMat3, DVec2, DVec3, Vec3};
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::{Panorama, file};
use crate::color::{Chromaticities, rec_709_from_xyz};
use crate::error::said;
use crate::output::read as input;
use crate::{Error, Result};

/// Maximum bytes of a file's header, which is a few lines of text.
const HEADER_MAX: u64 = 1 << 16;

/// The map at `path`, and a sentence about each line of its header that was ignored.
pub fn read(path: &Path) -> Result<(Panorama, Vec<String>)> {
    let length = input::about(path, "a Radiance image")?.len();
    let broken = |why: &str| Error::file(path, format!("is not a readable Radiance image ({why}); save it again"));
    let failed = |e: std::io::Error| input::unreadable(path, &e);
    let mut file = File::open(path).map_err(failed)?;
    let mut start = Vec::new();
    (&mut file).take(HEADER_MAX).read_to_end(&mut start).map_err(failed)?;
    let header = Header::parse(&start).map_err(|why| broken(&why))?;
    let [width, height] = header.size();
    file::check_size(path, width, height)?;
    let texels = width as usize * height as usize;
    // A run holds at most 127 texels of 8 bytes.
    input::check_length(path, length >= texels as u64 / 64)?;
    // Texels exist three times: in the decoder, as read, and as radiance.
    input::check_memory(path, 40 * texels as u64, "map")?;
    file.seek(SeekFrom::Start(header.end as u64)).map_err(failed)?;
    let [lines, across] = header.axes.map(|axis| axis.length);
    // The decoder knows only one order of lines and texels, and one name of the format.
    let plain = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {lines} +X {across}\n");
    let decoder = HdrDecoder::new(Cursor::new(plain).chain(BufReader::new(file))).map_err(|e| broken(&said(&e)))?;
    // Zeroed memory costs nothing until it is written: a file may claim more texels than it holds.
    let mut channels = vec![0.0_f32; 3 * texels];
    decoder.read_image(bytemuck::cast_slice_mut(&mut channels)).map_err(|e| broken(&said(&e)))?;
    let radiance = |at: usize| {
        let stored = Vec3::from_slice(&channels[3 * header.place(at % width as usize, at / width as usize)..]);
        if header.radiance_from_stored == DMat3::IDENTITY {
            return stored;
        }
        (header.radiance_from_stored * stored.as_dvec3()).as_vec3()
    };
    let radiance = (0..texels).map(radiance).collect();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let notes = header.unheeded.iter().map(|line| format!("{name}: {line} in its header was ignored")).collect();
    Ok((Panorama { width: width as usize, height: height as usize, radiance }, notes))
}

/// One of the two axes along which texels are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    /// Whether the axis is horizontal.
    across: bool,
    /// Whether texels begin at the left or at the top.
    forward: bool,
    length: u32,
}

#[derive(Debug)]
struct Header {
    /// Axis of the lines, then the axis within a line.
    axes: [Axis; 2],
    /// The product of all exposures, colour corrections and primaries.
    radiance_from_stored: DMat3,
    /// Lines that were ignored.
    unheeded: Vec<String>,
    /// Bytes before the first line of texels.
    end: usize,
}

impl Header {
    /// The error is a part of a sentence.
    fn parse(start: &[u8]) -> std::result::Result<Self, String> {
        if !start.starts_with(b"#?") {
            return Err("it does not begin with #?RADIANCE or #?RGBE".into());
        }
        let mut end = 0;
        let mut next = || {
            let line = start[end..].split_inclusive(|b| *b == b'\n').next().filter(|line| line.ends_with(b"\n"));
            end += line.map_or(0, <[u8]>::len);
            line.map(|line| String::from_utf8_lossy(line).trim().to_owned()).ok_or("its header does not end")
        };
        let mut values = Values { gain: DVec3::ONE, primaries: None, xyz: false, unheeded: Vec::new() };
        loop {
            let line = next()?;
            match line.split_once('=') {
                _ if line.is_empty() => break,
                Some((key, value)) if !line.starts_with('#') => values.heed(key.trim(), value.trim())?,
                _ => {}
            }
        }
        let size = next()?;
        let axes = axes(&size).ok_or_else(|| format!("\"{}\" is no size and order of texels", said(&size)))?;
        let radiance_from_stored = values.radiance_from_stored();
        Ok(Self { axes, radiance_from_stored, unheeded: values.unheeded, end })
    }

    /// Columns and rows.
    fn size(&self) -> [u32; 2] {
        let [lines, along] = self.axes.map(|axis| axis.length);
        if self.axes[0].across { [lines, along] } else { [along, lines] }
    }

    /// The stored number of the texel in column x and row y.
    fn place(&self, x: usize, y: usize) -> usize {
        let [line, at] = self.axes.map(|axis| {
            let from_start = if axis.across { x } else { y };
            if axis.forward { from_start } else { axis.length as usize - 1 - from_start }
        });
        line * self.axes[1].length as usize + at
    }
}

/// Axes of a line such as "-Y 512 +X 1024": rows from the top, each from the left. Y counts upwards.
fn axes(line: &str) -> Option<[Axis; 2]> {
    let axis = |name: &str, length: &str| {
        let (across, forward) = match name {
            "+X" => (true, true),
            "-X" => (true, false),
            "-Y" => (false, true),
            "+Y" => (false, false),
            _ => return None,
        };
        Some(Axis { across, forward, length: length.parse().ok()? })
    };
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, lines, second, along] = words[..] else { return None };
    let axes = [axis(first, lines)?, axis(second, along)?];
    (axes[0].across != axes[1].across).then_some(axes)
}

/// Values from all lines of a header. Exposures and colour corrections may occur several times, once for each
/// processing step.
struct Values {
    /// Radiance of a stored 1.
    gain: DVec3,
    primaries: Option<Chromaticities>,
    xyz: bool,
    unheeded: Vec<String>,
}

impl Values {
    /// Applies a line of the header. The error is that of [`Header::parse`].
    fn heed(&mut self, key: &str, value: &str) -> std::result::Result<(), String> {
        let numbers: Option<Vec<f64>> = value.split_whitespace().map(|number| number.parse().ok()).collect();
        let numbers = numbers.unwrap_or_default();
        let positive = numbers.iter().all(|n| *n > 0.0 && n.is_finite());
        let heeded = match (key.to_ascii_uppercase().as_str(), &numbers[..]) {
            ("FORMAT", _) => {
                self.xyz = value.eq_ignore_ascii_case("32-bit_rle_xyze");
                if !self.xyz && !value.eq_ignore_ascii_case("32-bit_rle_rgbe") {
                    return Err(format!("it has the format \"{}\"", said(&value)));
                }
                true
            }
            ("EXPOSURE", [exposure]) if positive => {
                self.gain /= *exposure;
                true
            }
            ("COLORCORR", [r, g, b]) if positive => {
                self.gain /= DVec3::new(*r, *g, *b);
                true
            }
            ("PRIMARIES", [rx, ry, gx, gy, bx, by, wx, wy]) => {
                let primaries = [[rx, ry], [gx, gy], [bx, by]].map(|[x, y]| DVec2::new(*x, *y));
                let stated = Chromaticities { primaries, white: DVec2::new(*wx, *wy) };
                let usable = stated.rec_709_from_rgb().is_some();
                self.primaries = self.primaries.or(Some(stated).filter(|_| usable));
                usable
            }
            ("GAMMA", [1.0]) => true,
            // Texels are linear; a file that says otherwise does not follow Radiance's format.
            ("EXPOSURE" | "COLORCORR" | "PRIMARIES" | "GAMMA", _) => false,
            // Lines about programs, views and dates do not affect texels.
            _ => true,
        };
        if !heeded {
            self.unheeded.push(said(&format!("{key}={value}")));
        }
        Ok(())
    }

    fn radiance_from_stored(&self) -> DMat3 {
        // Radiance's own white has equal energy.
        let even = DVec2::splat(1.0 / 3.0);
        let colors = match (self.xyz, &self.primaries) {
            (true, _) => rec_709_from_xyz(even),
            (false, Some(primaries)) => primaries.rec_709_from_rgb(),
            (false, None) => None,
        };
        let gain = DMat3::from_diagonal(self.gain);
        colors.map_or(gain, |colors| colors * gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(lines: &str) -> std::result::Result<Header, String> {
        Header::parse(lines.as_bytes())
    }

    #[test]
    fn lines_of_exposure_and_colour_multiply() {
        let text =
            "#?RGBE\nEXPOSURE=2\nCOLORCORR= 1 2 4\n# EXPOSURE=9\nexposure = 4\nEXPOSURE=0\nGAMMA=2.2\n\n-Y 2 +X 3\n";
        let header = parse(text).unwrap();
        assert_eq!(header.radiance_from_stored * DVec3::ONE, DVec3::new(1.0, 0.5, 0.25) / 8.0);
        assert_eq!(header.unheeded, ["EXPOSURE=0", "GAMMA=2.2"]);
        assert_eq!((header.size(), header.end), ([3, 2], text.len()));
        let same = parse("#?RADIANCE\nPRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329\n\n-Y 2 +X 3\n").unwrap();
        assert_eq!(same.radiance_from_stored, DMat3::IDENTITY);
        let none = parse("#?RADIANCE\nPRIMARIES=0 0 0 0 0 0 0 0\n\n-Y 2 +X 3\n").unwrap();
        assert_eq!((none.radiance_from_stored, none.unheeded.len()), (DMat3::IDENTITY, 1));
        let xyz = parse("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 3\n").unwrap();
        assert!((xyz.radiance_from_stored * DVec3::ONE - DVec3::ONE).abs().max_element() < 1e-9);
        assert!((xyz.radiance_from_stored.y_axis.y - 1.8).abs() < 0.2, "luminance is mostly green");
    }

    /// Texels are numbered in stored order.
    #[test]
    fn every_order_of_texels_is_known() {
        for (order, rows) in [
            ("-Y 2 +X 3", [[0, 1, 2], [3, 4, 5]]),
            ("-Y 2 -X 3", [[2, 1, 0], [5, 4, 3]]),
            ("+Y 2 +X 3", [[3, 4, 5], [0, 1, 2]]),
            ("+Y 2 -X 3", [[5, 4, 3], [2, 1, 0]]),
            ("+X 3 -Y 2", [[0, 2, 4], [1, 3, 5]]),
            ("+X 3 +Y 2", [[1, 3, 5], [0, 2, 4]]),
            ("-X 3 -Y 2", [[4, 2, 0], [5, 3, 1]]),
            ("-X 3 +Y 2", [[5, 3, 1], [4, 2, 0]]),
        ] {
            let header = parse(&format!("#?RADIANCE\n\n{order}\n")).unwrap();
            assert_eq!(header.size(), [3, 2], "{order}");
            assert_eq!([0, 1].map(|y| [0, 1, 2].map(|x| header.place(x, y))), rows, "{order}");
        }
        for order in ["-Y 2 +Y 3", "-Y 2", "-Y 2 +X 3 4", "-Z 2 +X 3", "-Y 2 +X -3", "-Y 2 +X 4294967296", ""] {
            assert!(parse(&format!("#?RADIANCE\n\n{order}\n")).unwrap_err().contains("order of texels"), "{order}");
        }
    }

    #[test]
    fn what_is_no_header_is_refused() {
        for (text, part) in [
            ("RADIANCE\n\n-Y 2 +X 3\n", "does not begin with"),
            ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "does not end"),
            ("#?RADIANCE\n\n-Y 2 +X 3", "does not end"),
            ("#?RADIANCE\nFORMAT=16-bit\n\n-Y 2 +X 3\n", "the format \"16-bit\""),
        ] {
            let why = parse(text).unwrap_err();
            assert!(why.contains(part), "{why}");
        }
        assert!(parse("#?RADIANCE\r\n\r\n-Y 2 +X 3\r\n").is_ok());
    }
}
