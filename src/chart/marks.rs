//! How a method's points look in charts: a colour and a shape, so that neither is needed to tell methods apart.

use serde::Serialize;

use crate::gi::Method;
use crate::output::svg::COLORS;

/// Outlines within a circle of radius 1, of about the same area: cross, triangle, circle, square, diamond, pentagon, hourglass.
const SHAPES: &[&str] = &[
    "M-.4-1.1H.4V-.4H1.1V.4H.4V1.1H-.4V.4H-1.1V-.4H-.4Z",
    "M0-1.25L1.15 .8H-1.15Z",
    "M1 0A1 1 0 0 1-1 0A1 1 0 0 1 1 0Z",
    "M-.9-.9H.9V.9H-.9Z",
    "M0-1.3L1.1 0L0 1.3L-1.1 0Z",
    "M0-1.15L1.1-.35L.7 .95H-.7L-1.1-.35Z",
    "M-1-1.1H1L.2 0L1 1.1H-1L-.2 0Z",
];

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Mark {
    pub method: &'static str,
    pub color: &'static str,
    /// A path's `d`, to be scaled by the radius.
    pub shape: &'static str,
}

pub fn mark(method: Method) -> Mark {
    let place = Method::ALL.iter().position(|known| *known == method).expect("the list has every method");
    Mark { method: method.name(), color: COLORS[place % COLORS.len()], shape: SHAPES[place % SHAPES.len()] }
}

/// The marks of some methods, each once, in the order of the list of methods.
pub fn marks(methods: impl IntoIterator<Item = Method>) -> Vec<Mark> {
    let used: Vec<Method> = methods.into_iter().collect();
    Method::ALL.iter().filter(|method| used.contains(method)).map(|method| mark(*method)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_differ_by_colour_and_by_shape() {
        let all = marks(Method::ALL.iter().copied());
        assert_eq!(all.len(), Method::ALL.len());
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                assert!(a.color != b.color && a.shape != b.shape, "{a:?} and {b:?}");
            }
        }
    }
}
