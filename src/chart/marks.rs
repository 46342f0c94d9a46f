//! Marks of points in charts: a colour and a shape for each method, for the path tracer and for other programs. Either
//! alone distinguishes them.

use serde::Serialize;

use super::row::{Row, Source};
use crate::gi::Method;
use crate::output::svg::COLORS;

/// Outlines within a circle of radius 1, of about the same area: cross, triangle, circle, square, diamond, pentagon,
/// hourglass.
const SHAPES: &[&str] = &[
    "M-.4-1.1H.4V-.4H1.1V.4H.4V1.1H-.4V.4H-1.1V-.4H-.4Z",
    "M0-1.25L1.15 .8H-1.15Z",
    "M1 0A1 1 0 0 1-1 0A1 1 0 0 1 1 0Z",
    "M-.9-.9H.9V.9H-.9Z",
    "M0-1.3L1.1 0L0 1.3L-1.1 0Z",
    "M0-1.15L1.1-.35L.7 .95H-.7L-1.1-.35Z",
    "M-1-1.1H1L.2 0L1 1.1H-1L-.2 0Z",
];

/// The path tracer's: a star with four points.
const PATH_TRACER: Mark = Mark {
    method: "path tracer",
    color: "#8b5cf6",
    shape: "M0-1.5L.35-.35L1.5 0L.35 .35L0 1.5L-.35 .35L-1.5 0L-.35-.35Z",
};

/// The mark of other programs: a ring, open in the middle.
const IMPORT: Mark = Mark {
    method: "other program",
    color: "#e11d48",
    shape: "M1.1 0A1.1 1.1 0 0 1-1.1 0A1.1 1.1 0 0 1 1.1 0ZM.55 0A.55 .55 0 0 0-.55 0A.55 .55 0 0 0 .55 0Z",
};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Mark {
    /// The name of the method, or a description of the image's maker.
    pub method: &'static str,
    pub color: &'static str,
    /// A path's `d`, to be scaled by the radius.
    pub shape: &'static str,
}

/// The mark of a row.
pub fn mark(row: &Row) -> Mark {
    match &row.source {
        Source::Settings => of_method(row.settings.as_ref().map_or(Method::None, |settings| settings.method)),
        Source::PathTracer { .. } => PATH_TRACER,
        Source::Import(_) => IMPORT,
    }
}

fn of_method(method: Method) -> Mark {
    let place = Method::ALL.iter().position(|known| *known == method).expect("the list has every method");
    Mark { method: method.name(), color: COLORS[place % COLORS.len()], shape: SHAPES[place % SHAPES.len()] }
}

/// The marks of some rows without repetition: methods in the order of their list, then the others.
pub fn marks<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Vec<Mark> {
    let used: Vec<Mark> = rows.into_iter().map(mark).collect();
    all().filter(|mark| used.contains(mark)).collect()
}

fn all() -> impl Iterator<Item = Mark> {
    Method::ALL.iter().map(|method| of_method(*method)).chain([PATH_TRACER, IMPORT])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_differ_by_colour_and_by_shape() {
        let all: Vec<Mark> = all().collect();
        assert_eq!(all.len(), Method::ALL.len() + 2);
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                assert!(a.color != b.color && a.shape != b.shape, "{a:?} and {b:?}");
            }
        }
    }
}
