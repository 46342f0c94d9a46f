//! Changes over time in excess of the reference.

use crate::layers::Layers;
use crate::{Error, Result};

/// The share of pixels that count as the worst.
const WORST: f64 = 0.01;

/// The sum of |change| between successive frames over all pixels.
pub fn changes(frames: &[Layers]) -> f64 {
    let values = |frame: &'_ Layers| frame.beauty().iter().flatten().map(|v| f64::from(*v)).collect::<Vec<f64>>();
    let of = |pair: &[Layers]| values(&pair[0]).iter().zip(values(&pair[1])).map(|(a, b)| (b - a).abs()).sum::<f64>();
    frames.windows(2).map(of).sum()
}

/// The mean of two images of one size.
pub fn mean(a: &Layers, b: &Layers) -> Layers {
    let pixels = a.beauty().iter().zip(b.beauty());
    Layers::new(a.width, a.height, pixels.map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))).collect())
}

/// The temporal excess of `frames` over `truths`, equally many and at least two of each: mean |ΔI − ΔR| over mean R,
/// with Δ between successive frames; and the same over the worst hundredth of the pixels.
pub fn excess(frames: &[Layers], truths: &[Layers]) -> Result<(f64, f64)> {
    let pixels = frames[0].beauty().len();
    let mut changes = vec![0.0; pixels];
    for (pair, true_pair) in frames.windows(2).zip(truths.windows(2)) {
        let lights = [&pair[0], &pair[1], &true_pair[0], &true_pair[1]].map(Layers::beauty);
        for (i, change) in changes.iter_mut().enumerate() {
            let [a, b, c, d] = lights.map(|light| light[i].map(f64::from));
            *change += (0..3).map(|k| ((b[k] - a[k]) - (d[k] - c[k])).abs()).sum::<f64>();
        }
    }
    let values: f64 = truths.iter().flat_map(|truth| truth.beauty().iter().flatten()).map(|v| f64::from(*v)).sum();
    let mean = values / (pixels * truths.len()) as f64;
    if mean <= 0.0 {
        return Err(Error::Usage("a case's reference is black".to_owned()));
    }
    let scale = 1.0 / (mean * (frames.len() - 1) as f64);
    changes.sort_by(|a, b| b.total_cmp(a));
    let most = ((pixels as f64 * WORST) as usize).max(1);
    let share = |changes: &[f64]| scale * changes.iter().sum::<f64>() / changes.len() as f64;
    Ok((share(&changes), share(&changes[..most])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(values: &[f32]) -> Layers {
        Layers::new(values.len() as u32, 1, values.iter().map(|v| [*v; 3]).collect())
    }

    #[test]
    fn what_the_reference_does_too_is_no_excess() {
        let truths = [frame(&[1.0; 100]), frame(&[3.0; 100])];
        assert_eq!(excess(&truths, &truths).unwrap(), (0.0, 0.0));
        // The frames are half as bright: the change is 1 instead of 2, and the mean of the reference is 2.
        let frames = [frame(&[0.5; 100]), frame(&[1.5; 100])];
        assert_eq!(excess(&frames, &truths).unwrap(), (0.5, 0.5));
    }

    #[test]
    fn changes_are_compared_where_something_should_change() {
        let truths = [frame(&[1.0; 4]), frame(&[3.0; 4])];
        assert_eq!(changes(&truths), 24.0);
        assert_eq!(changes(&[frame(&[1.0; 4]), frame(&[0.0; 4]), frame(&[1.0; 4])]), 24.0);
    }

    #[test]
    fn one_pixel_that_flickers_is_among_the_worst() {
        let still = [frame(&[1.0; 100]), frame(&[1.0; 100])];
        let mut flickers = still.clone();
        flickers[1].layers[0].1[7] = [2.0; 3];
        let (all, worst) = excess(&flickers, &still).unwrap();
        assert!((all - 0.01).abs() < 1e-12 && (worst - 1.0).abs() < 1e-12, "{all} {worst}");
    }
}
